// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/modality.hpp"

namespace orbitfuse {

struct PosedView {
  std::string name;  ///< file relative to the session folder, e.g. "visible/000003.jpg"
  Camera camera;
  Rigid3d cam_from_world;
};

struct Observation {
  int view = 0;           ///< index into Reconstruction::views
  Eigen::Vector2d pixel;  ///< as in Camera
};

struct SparsePoint {
  Eigen::Vector3d position;
  std::array<std::uint8_t, 3> rgb{};
  double reprojection_error_px = 0;
  std::vector<Observation> track;
};

/// Posed views of one modality and the points seen in them; what a COLMAP model holds.
struct Reconstruction {
  Modality modality = Modality::visible;
  std::vector<PosedView> views;
  std::vector<SparsePoint> points;
};

/// Dense geometry of one posed view.
struct DepthMap {
  int view = 0;   ///< index into the Reconstruction's views
  Camera camera;  ///< of the map itself: may be smaller than the view's, never distorted
  /// CV_32FC1, z along the optical axis, world units; NaN = unknown, infinite = the sky (a field's
  /// nerf::RenderedView has NaN for both).
  cv::Mat depth;
  cv::Mat confidence;  ///< CV_32FC1 in [0, 1]
  cv::Mat normal;      ///< CV_32FC3 in camera axes, towards the camera; may be empty
};

}  // namespace orbitfuse
