// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"

namespace orbitfuse::depth {

/// A view without lens distortion at the size of its depth map, in units of the scene radius.
struct DepthView {
  Camera camera;
  cv::Mat gray;  ///< CV_8UC1, continuous, with rows_padding more rows that may be read, not used
  Eigen::Matrix3f world_rotation;  ///< camera axes from world axes
  Eigen::Vector3f translation;     ///< x_cam = world_rotation * x + translation
  Eigen::Vector3f center() const { return -(world_rotation.transpose() * translation); }
  Eigen::Vector3f axis() const { return world_rotation.row(2).transpose(); }
};

/// Where a pixel of this depth (along the optical axis) lies in the world.
Eigen::Vector3f world_of(const DepthView& view, const Eigen::Vector2d& pixel, float depth);

inline constexpr int rows_padding = 2;

/// Undistorts and shrinks (area average). `image`: 8-bit gray or BGR of the camera's size.
DepthView prepare_view(const cv::Mat& image, const Camera& camera, const Rigid3d& cam_from_world,
                       const Eigen::Vector3d& scene_center, double scene_radius, int width_px);

/// The same view at half the width.
DepthView halved(const DepthView& view);

}  // namespace orbitfuse::depth
