// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/view/layers.hpp"

namespace orbitfuse::view {

/// What a page may ask to be rendered; a picture costs by its pixels.
inline constexpr int least_shot_px = 16;
inline constexpr int most_shot_pixels = 1'400'000;

struct ShotRequest {
  std::string client;
  Shot shot;
  LayerWish wish;
};

/// Of {"position": [x,y,z], "rotation_wxyz": [w,x,y,z], "fov_deg": of the height, "width",
/// "height"}, a camera in OpenGL's axes as three.js has it (x right, y up, looks along -z); or of
/// {"view": index into run.views, "width"}: as that camera saw. Usage error naming the field.
Result<Shot> shot_of(const nlohmann::json& j, const FinishedRun& run);

/// As above with "client" (1 to 40 characters), and if given "layers", "divisor", "thermal_divisor"
/// and "detail".
Result<ShotRequest> shot_request_of(const nlohmann::json& j, const FinishedRun& run);

/// A pinhole whose axis goes through the middle; `fov_deg` is of the height.
Camera camera_of(double fov_deg, int width, int height);

/// A camera as the browser has it: {"position", "rotation_wxyz", "fov_deg", "aspect"}.
nlohmann::json browser_camera(const Camera& camera, const Rigid3d& cam_from_world);

}  // namespace orbitfuse::view
