// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>

#include "core/progress.hpp"
#include "core/result.hpp"

// Scale-invariant features (D. Lowe, Distinctive Image Features from Scale-Invariant Keypoints,
// IJCV 2004) with the choices of COLMAP's extraction on a CPU, so that its mapper finds what it was
// tuned on: the same extrema, orientations and descriptors to rounding.
// docs/notes/poses_visible.md tells what other features did to the mapper.
namespace orbitfuse {

struct SiftOptions {
  int max_features = 3000;  ///< about: whole levels of scale, the coarsest first
  double peak_threshold =
      0.02 / 3;                ///< contrast of the difference of Gaussians; black to white is 1
  double edge_threshold = 10;  ///< ratio of principal curvatures beyond which a peak is an edge's
  int octaves = 4;             ///< the first at twice the image's size
  int max_orientations = 2;    ///< features that one peak may give

  /// Input error naming the field that is out of its range.
  Status validate() const;
};

/// Position in pixels of the image, the centre of the first at 0.5; the blur's standard deviation
/// in pixels; the dominant gradient's direction, clockwise as one sees it (y points down).
struct SiftKeypoint {
  float x = 0, y = 0, scale_px = 0, orientation_rad = 0;
};

struct SiftFeatures {
  using Bytes = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 128, Eigen::RowMajor>;
  std::vector<SiftKeypoint> keypoints;
  /// A row a keypoint: 512 times the root of the histograms' shares (a unit vector), in Lowe's
  /// order.
  Bytes descriptors;
};

/// Of an 8-bit image of one channel, finer scales first; none of an empty, tiny or constant one.
/// The same on every processor, on one thread.
SiftFeatures sift_features(const cv::Mat& gray, const SiftOptions& options);

}  // namespace orbitfuse
