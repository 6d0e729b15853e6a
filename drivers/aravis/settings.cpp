// SPDX-License-Identifier: BSD-3-Clause
// One setting of a profile: pushed, read back, compared.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/aravis/link.hpp"

namespace orbitfuse::aravis {
namespace {

/// What a camera makes of a number: it rounds to its increment or to what its clock can do.
bool close_enough(ArvCamera* camera, const char* feature, double wanted, double found) {
  constexpr double relative = 1e-3;
  double step = 0;
  GError* error = nullptr;
  const double increment = arv_camera_get_float_increment(camera, feature, &error);
  // Features without one give the smallest number there is, or an error.
  if (!error && std::isfinite(increment) && increment > 0) step = increment;
  g_clear_error(&error);
  return std::abs(found - wanted) <= std::max(step, relative * std::abs(wanted));
}

/// What the camera has now, as text, when that is not what was wanted.
struct Pusher {
  ArvCamera* camera;
  const char* feature;
  GError*& error;

  std::optional<std::string> operator()(bool wanted) const {
    arv_camera_set_boolean(camera, feature, wanted, &error);
    if (error) return {};
    const bool found = arv_camera_get_boolean(camera, feature, &error) != 0;
    return found == wanted ? std::nullopt : std::optional(fmt::format("{}", found));
  }
  std::optional<std::string> operator()(std::int64_t wanted) const {
    arv_camera_set_integer(camera, feature, wanted, &error);
    if (error) return {};
    const std::int64_t found = arv_camera_get_integer(camera, feature, &error);
    return found == wanted ? std::nullopt : std::optional(fmt::format("{}", found));
  }
  std::optional<std::string> operator()(double wanted) const {
    arv_camera_set_float(camera, feature, wanted, &error);
    if (error) return {};
    const double found = arv_camera_get_float(camera, feature, &error);
    if (error || close_enough(camera, feature, wanted, found)) return {};
    return fmt::format("{:g}", found);
  }
  std::optional<std::string> operator()(const std::string& wanted) const {
    arv_camera_set_string(camera, feature, wanted.c_str(), &error);
    if (error) return {};
    const std::string found = text(arv_camera_get_string(camera, feature, &error));
    return found == wanted ? std::nullopt : std::optional("\"" + found + "\"");
  }
};

std::string shown(const FeatureValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

}  // namespace

Status push_setting(ArvCamera* camera, const std::string& profile, const std::string& feature,
                    const FeatureValue& value) {
  const std::string where = profile + ": " + feature;
  if (!arv_camera_is_feature_available(camera, feature.c_str(), nullptr)) {
    return fail(ErrorKind::usage, where, "the camera has no such feature",
                "correct the profile in config/cameras or choose another");
  }
  GError* error = nullptr;
  const std::optional<std::string> other =
      std::visit(Pusher{camera, feature.c_str(), error}, value);
  if (error)
    return fail(ErrorKind::device, where, take_text(error),
                "correct the profile, or close another program that controls the camera");
  if (!other) return {};
  return fail(ErrorKind::device, where,
              fmt::format("set to {}, reads back {}", shown(value), *other),
              "write a value that the camera has into the profile, or close another program that "
              "controls the camera");
}

}  // namespace orbitfuse::aravis
