// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"

namespace orbitfuse {

/// What a depth map (CV_32FC1, z along the optical axis, of this camera) has at its pixel's middle,
/// in the camera's axes and the map's unit. Not finite where it has no depth.
inline Eigen::Vector3d lifted(const cv::Mat& depth, const Camera& camera, int x, int y) {
  return static_cast<double>(depth.at<float>(y, x)) * camera.ray_of({x + 0.5, y + 0.5});
}

}  // namespace orbitfuse
