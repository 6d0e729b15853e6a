// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"

namespace orbitfuse {

/// An image of one channel taken by `from` (at its size), as `to` would have taken it from the same
/// place; what lies outside repeats the border. 8-bit or float samples.
cv::Mat undistorted(const cv::Mat& image, const Camera& from, const Camera& to);

}  // namespace orbitfuse
