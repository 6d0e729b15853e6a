// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/shot_request.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "app/view/json_fields.hpp"

namespace orbitfuse::view {
namespace {
using nlohmann::json;

constexpr double degrees_per_radian = 57.29577951308232;
/// OpenGL's camera axes from OpenCV's, and back: half a turn round x.
const Eigen::Quaterniond half_turn_x(0, 1, 0, 0);

tl::unexpected<Error> wrong(const std::string& field, const std::string& found,
                            const std::string& wanted) {
  return fail(ErrorKind::usage, field, found, wanted);
}

Status check_size(int width, int height) {
  if (width < least_shot_px || height < least_shot_px || width > most_shot_pixels / height)
    return wrong(
        "width, height", fmt::format("{} x {}", width, height),
        fmt::format("must be {} or more, and {} pixels at most", least_shot_px, most_shot_pixels));
  return {};
}

/// The recorded camera at another width.
Result<Shot> recorded_shot(const json& j, const FinishedRun& run) {
  const json& index = j["view"];
  if (!index.is_number_integer() || index.get<std::int64_t>() < 0 ||
      index.get<std::int64_t>() >= static_cast<std::int64_t>(run.views.size()))
    return wrong("view", shown(index), fmt::format("must be below {}", run.views.size()));
  const PosedView& view = run.views[static_cast<std::size_t>(index.get<std::int64_t>())].view;
  ORBITFUSE_ASSIGN(const double wide, number_field(j, "width", least_shot_px, 4096));
  const int width = static_cast<int>(wide);
  const int height = static_cast<int>(
      std::lround(static_cast<double>(width) * view.camera.height / view.camera.width));
  ORBITFUSE_TRY(check_size(width, height));
  return Shot{view.camera.without_distortion().scaled_to(width, height), view.cam_from_world};
}

}  // namespace

Result<Shot> shot_of(const json& j, const FinishedRun& run) {
  if (j.contains("view")) return recorded_shot(j, run);
  ORBITFUSE_ASSIGN(const auto position, (number_fields<3>(j, "position")));
  ORBITFUSE_ASSIGN(const auto q, (number_fields<4>(j, "rotation_wxyz")));
  ORBITFUSE_ASSIGN(const double fov_deg, number_field(j, "fov_deg", 1, 150));
  ORBITFUSE_ASSIGN(const double wide, number_field(j, "width", least_shot_px, 8192));
  ORBITFUSE_ASSIGN(const double high, number_field(j, "height", least_shot_px, 8192));
  const int width = static_cast<int>(wide), height = static_cast<int>(high);
  ORBITFUSE_TRY(check_size(width, height));
  const Eigen::Quaterniond given(q[0], q[1], q[2], q[3]);
  if (!(std::abs(given.norm() - 1) < 1e-3))
    return wrong("rotation_wxyz", shown(j["rotation_wxyz"]), "must be a unit quaternion");
  Shot shot;
  shot.camera = camera_of(fov_deg, width, height);
  const Rigid3d world_from_cam{(given.normalized() * half_turn_x).normalized(),
                               {position[0], position[1], position[2]}};
  shot.cam_from_world = world_from_cam.inverse();
  return shot;
}

Result<ShotRequest> shot_request_of(const json& j, const FinishedRun& run) {
  ShotRequest request;
  ORBITFUSE_ASSIGN(request.client, text_field(j, "client", 40));
  ORBITFUSE_ASSIGN(request.shot, shot_of(j, run));
  if (const auto layers = j.find("layers"); layers != j.end()) {
    request.wish = {.visible = false, .thermal = false, .fused = false};
    if (!layers->is_array()) return wrong("layers", shown(*layers), "must be a list of names");
    for (const json& layer : *layers) {
      if (layer == "visible")
        request.wish.visible = true;
      else if (layer == "thermal")
        request.wish.thermal = true;
      else if (layer == "fused")
        request.wish.fused = true;
      else
        return wrong("layers", shown(layer), "must be visible, thermal or fused");
    }
  }
  if (const auto detail = j.find("detail"); detail != j.end()) {
    if (!detail->is_boolean()) return wrong("detail", shown(*detail), "must be true or false");
    request.wish.detail = *detail;
  }
  for (const auto& [field, to] : {std::pair{"divisor", &request.wish.divisor},
                                  {"thermal_divisor", &request.wish.thermal_divisor}})
    if (j.contains(field)) {
      ORBITFUSE_ASSIGN(const double divisor, number_field(j, field, 1, most_divisor));
      *to = static_cast<int>(divisor);
    }
  return request;
}

Camera camera_of(double fov_deg, int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.5 * height / std::tan(0.5 * fov_deg / degrees_per_radian);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

json browser_camera(const Camera& camera, const Rigid3d& cam_from_world) {
  const Rigid3d world_from_cam = cam_from_world.inverse();
  const Eigen::Quaterniond q = (world_from_cam.rotation * half_turn_x).normalized();
  const Eigen::Vector3d& p = world_from_cam.translation;
  return {{"position", {p.x(), p.y(), p.z()}},
          {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"fov_deg", 2 * degrees_per_radian * std::atan(0.5 * camera.height / camera.fy)},
          {"aspect", static_cast<double>(camera.width) * camera.fy / (camera.height * camera.fx)}};
}

}  // namespace orbitfuse::view
