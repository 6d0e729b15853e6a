// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/shot_request.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "app/view/request_fields.hpp"

namespace orbitfuse::view {
namespace {
using nlohmann::json;

constexpr double degrees_per_radian = 57.29577951308232;
/// OpenGL's camera axes from OpenCV's, and back: half a turn round x.
const Eigen::Quaterniond half_turn_x(0, 1, 0, 0);

Status check_size(int width, int height) {
  if (width < least_shot_px || height < least_shot_px || width > most_shot_pixels / height)
    return fail(
        ErrorKind::usage, "width, height", fmt::format("{} x {}", width, height),
        fmt::format("must be {} or more, and {} pixels at most", least_shot_px, most_shot_pixels));
  return {};
}

/// The recorded camera at another width.
Result<Shot> recorded_shot(const JsonFields& fields, const FinishedRun& run) {
  std::uint64_t index = 0;
  if (!fields.get("view", index) || index >= run.views.size())
    return fields.wrong("view", fmt::format("a whole number below {}", run.views.size()));
  const PosedView& view = run.views[index].view;
  double wide = 0;
  ORBITFUSE_TRY(fields.get("width", wide, from_to(least_shot_px, 4096)));
  const int width = static_cast<int>(wide);
  const int height = static_cast<int>(
      std::lround(static_cast<double>(width) * view.camera.height / view.camera.width));
  ORBITFUSE_TRY(check_size(width, height));
  return Shot{view.camera.without_distortion().scaled_to(width, height), view.cam_from_world};
}

}  // namespace

Result<Shot> shot_of(const json& j, const FinishedRun& run) {
  const JsonFields fields = request_fields(j);
  if (j.contains("view")) return recorded_shot(fields, run);
  Eigen::Vector3d position;
  std::array<double, 4> q{};
  double fov_deg = 0, wide = 0, high = 0;
  ORBITFUSE_TRY(fields.get("position", position, reachable));
  ORBITFUSE_TRY(fields.get("rotation_wxyz", q));
  ORBITFUSE_TRY(fields.get("fov_deg", fov_deg, from_to(1, 150)));
  ORBITFUSE_TRY(fields.get("width", wide, from_to(least_shot_px, 8192)));
  ORBITFUSE_TRY(fields.get("height", high, from_to(least_shot_px, 8192)));
  const int width = static_cast<int>(wide), height = static_cast<int>(high);
  ORBITFUSE_TRY(check_size(width, height));
  const Eigen::Quaterniond given(q[0], q[1], q[2], q[3]);
  if (!(std::abs(given.norm() - 1) < 1e-3))
    return fields.wrong("rotation_wxyz", "a unit quaternion");
  Shot shot;
  shot.camera = camera_of(fov_deg, width, height);
  const Rigid3d world_from_cam{(given.normalized() * half_turn_x).normalized(), position};
  shot.cam_from_world = world_from_cam.inverse();
  return shot;
}

Result<ShotRequest> shot_request_of(const json& j, const FinishedRun& run) {
  ShotRequest request;
  const JsonFields fields = request_fields(j);
  ORBITFUSE_TRY(fields.get_word("client", request.client, 40));
  ORBITFUSE_ASSIGN(request.shot, shot_of(j, run));
  if (fields.has("layers")) {
    std::vector<std::string> layers;
    ORBITFUSE_TRY(fields.get("layers", layers));
    request.wish = {.visible = false, .thermal = false, .fused = false};
    for (const std::string& layer : layers) {
      if (layer == "visible")
        request.wish.visible = true;
      else if (layer == "thermal")
        request.wish.thermal = true;
      else if (layer == "fused")
        request.wish.fused = true;
      else
        return fields.wrong("layers", "a list of visible, thermal and fused");
    }
  }
  if (fields.has("detail")) ORBITFUSE_TRY(fields.get("detail", request.wish.detail));
  for (const auto& [field, to] : {std::pair{"divisor", &request.wish.divisor},
                                  {"thermal_divisor", &request.wish.thermal_divisor}})
    if (fields.has(field)) {
      double divisor = 1;
      ORBITFUSE_TRY(fields.get(field, divisor, from_to(1, most_divisor)));
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
