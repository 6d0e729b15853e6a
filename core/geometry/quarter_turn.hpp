// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/geometry/reconstruction.hpp"

// A camera mounted upside down, or on its side to fit a tall object. The search knows upright ones.
namespace orbitfuse {

struct QuarterTurn {
  int clockwise = 0;  ///< 0 to 3: how often the image as taken is turned to be upright

  double degrees() const { return 90.0 * clockwise; }
  QuarterTurn back() const { return {(4 - clockwise) % 4}; }
};

/// The image, and the camera that would have taken it without the turn.
cv::Mat upright(QuarterTurn turn, const cv::Mat& image);
/// Without distortion.
Camera upright(QuarterTurn turn, const Camera& taken);

/// Pose and pinhole camera of the image as it was taken.
PosedView as_taken(QuarterTurn turn, const PosedView& upright);

}  // namespace orbitfuse
