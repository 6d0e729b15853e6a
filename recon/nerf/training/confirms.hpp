// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/geometry/reconstruction.hpp"

namespace orbitfuse::nerf {

/// Whether a depth map has, within 1 %, a surface where the point lies (in its camera's axes).
inline bool confirms(const DepthMap& map, const Eigen::Vector3d& in_cam) {
  constexpr double same_depth = 0.01;
  if (!(in_cam.z() > 0)) return false;
  const Eigen::Vector2d pixel = map.camera.project(in_cam);
  if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < map.depth.cols &&
        pixel.y() < map.depth.rows))
    return false;
  const float z = map.depth.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
  return std::abs(z - in_cam.z()) < same_depth * in_cam.z();
}

}  // namespace orbitfuse::nerf
