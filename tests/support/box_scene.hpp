// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse::testing_orbit {

/// A box with ribs on its sides and a small box on one end, ray-cast: what a trained field of a
/// container would render. `hot` gives other values to the faces, as a thermal camera sees them.
inline SceneRender box_view(const Camera& camera, const Rigid3d& cam_from_world, bool hot) {
  SceneRender view{cv::Mat(camera.height, camera.width, CV_32F),
                   cv::Mat(camera.height, camera.width, CV_32F)};
  const Rigid3d world_from_cam = cam_from_world.inverse();
  const Eigen::Vector3d origin = world_from_cam.translation;
  const Eigen::Vector3d boxes[][2] = {{{-0.4, -0.15, -0.15}, {0.4, 0.15, 0.15}},
                                      {{0.2, -0.1, 0.15}, {0.35, 0.1, 0.27}}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = camera.ray_of({x + 0.5, y + 0.5});
      const Eigen::Vector3d d = world_from_cam.rotation * ray;
      double nearest = std::numeric_limits<double>::infinity();
      float value = 0.3F;
      for (const auto& box : boxes) {
        double enter = 0, leave = 1e9;
        int face = 0;
        for (int axis = 0; axis < 3; ++axis) {
          double a = (box[0][axis] - origin[axis]) / d[axis],
                 b = (box[1][axis] - origin[axis]) / d[axis];
          if (a > b) std::swap(a, b);
          if (a > enter) enter = a, face = axis;
          leave = std::min(leave, b);
        }
        if (enter >= leave || enter >= nearest || enter <= 0) continue;
        nearest = enter;
        const Eigen::Vector3d p = origin + enter * d;
        const bool rib = face == 1 && std::fmod(p.x() + 10, 0.16) < 0.05;
        const float shades[] = {0.9F, 0.6F, 0.75F};
        const float heats[] = {0.5F, 0.95F, 0.65F};
        value = (hot ? heats : shades)[face] + (rib ? (hot ? 0.12F : -0.25F) : 0.0F);
      }
      view.brightness.at<float>(y, x) = value;
      view.depth.at<float>(y, x) = std::isfinite(nearest) ? static_cast<float>(nearest)
                                                          : std::numeric_limits<float>::quiet_NaN();
    }
  return view;
}

inline SceneRenderer box_renderer() {
  return [](const Camera& camera, const Rigid3d& pose) -> Result<SceneRender> {
    return box_view(camera, pose, false);
  };
}

}  // namespace orbitfuse::testing_orbit
