// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace orbitfuse {

/// Tag corners, four after each other: metres in the mat's frame and pixels.
struct MatCorners {
  std::vector<cv::Point3d> mat;
  std::vector<cv::Point2d> image;
};

/// Follows the mat's corners where its tags can't be read (blur, glare), by pyramidal Lucas-Kanade
/// optical flow from the last image (Bouguet 2000), kept where flow back returns to the start. The
/// mat's texture repeats: a jump by one tag would look right. So what is followed may steer the
/// operator but prove no station.
class MatTracker {
 public:
  /// After a sighting that was read.
  void remember(const cv::Mat& gray, const MatCorners& corners);
  /// Nothing before a sighting, when too few corners can be followed, or too long after it.
  std::optional<MatCorners> follow(const cv::Mat& gray);

 private:
  cv::Mat before_;
  MatCorners corners_;
  int steps_ = 0;
};

}  // namespace orbitfuse
