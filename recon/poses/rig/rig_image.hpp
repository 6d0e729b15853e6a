// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/camera.hpp"

namespace orbitfuse {

/// An image seen by another camera at the same place, turned by `target_from_source`; NaN where the
/// source shows nothing.
cv::Mat seen_from(const cv::Mat& source, const Camera& source_camera,
                  const Eigen::Quaterniond& target_from_source, const Camera& target);

/// Depth along the axis of a camera for each of its pixels, from the sparse points (in its axes) by
/// nearest neighbour in a coarse grid: enough for the small parallax of one housing.
cv::Mat sparse_depth(const std::vector<Eigen::Vector3d>& points, const Camera& camera);

}  // namespace orbitfuse
