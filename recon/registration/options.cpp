// SPDX-License-Identifier: BSD-3-Clause
#include "core/option_range.hpp"
#include "recon/registration/register.hpp"

namespace orbitfuse {

Status RegistrationOptions::validate() const {
  const OptionCheck check("registration");
  ORBITFUSE_TRY(check("points", points, from_to(100, 65000)));
  ORBITFUSE_TRY(check("max_pair_distance", max_pair_distance, above_up_to(0, 0.5)));
  ORBITFUSE_TRY(check("inlier_distance", inlier_distance, above_up_to(0, max_pair_distance)));
  ORBITFUSE_TRY(check("min_scale", min_scale, above(0)));
  ORBITFUSE_TRY(check("max_scale", max_scale, above(min_scale)));
  ORBITFUSE_TRY(check("decisive_score", decisive_score, above_up_to(0, 1)));
  ORBITFUSE_TRY(check("ambiguity_ratio", ambiguity_ratio, above_up_to(0, 1)));
  if (!use_features && !use_grid)
    return fail(ErrorKind::usage, "registration.use_grid", "false, and use_features too",
                "leave one initialiser on");
  return check("restarts", restarts, from_to(0, 100));
}

}  // namespace orbitfuse
