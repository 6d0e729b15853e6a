// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "recon/registration/register.hpp"

namespace orbitfuse {

Status RegistrationOptions::validate() const {
  const auto wrong = [](const char* field, double value, const char* rule) {
    return fail(ErrorKind::usage, fmt::format("registration.{}", field), fmt::format("{}", value),
                rule);
  };
  if (points < 100 || points > 65000) return wrong("points", points, "must be 100 to 65000");
  if (!(max_pair_distance > 0 && max_pair_distance <= 0.5)) {
    return wrong("max_pair_distance", max_pair_distance, "must be > 0 and <= 0.5 of the diameter");
  }
  if (!(inlier_distance > 0 && inlier_distance <= max_pair_distance)) {
    return wrong("inlier_distance", inlier_distance, "must be > 0 and <= max_pair_distance");
  }
  if (!(min_scale > 0)) return wrong("min_scale", min_scale, "must be > 0");
  if (!(max_scale > min_scale) || !std::isfinite(max_scale)) {
    return wrong("max_scale", max_scale, "must be finite and > min_scale");
  }
  if (!(decisive_score > 0 && decisive_score <= 1)) {
    return wrong("decisive_score", decisive_score, "must be > 0 and <= 1");
  }
  if (!(ambiguity_ratio > 0 && ambiguity_ratio <= 1)) {
    return wrong("ambiguity_ratio", ambiguity_ratio, "must be > 0 and <= 1");
  }
  if (!use_features && !use_grid) {
    return fail(ErrorKind::usage, "registration.use_grid", "false, and use_features too",
                "leave one initialiser on");
  }
  if (restarts < 0 || restarts > 100) return wrong("restarts", restarts, "must be 0 to 100");
  return {};
}

}  // namespace orbitfuse
