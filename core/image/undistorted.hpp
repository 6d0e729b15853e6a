// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/geometry/camera.hpp"

namespace orbitfuse {

/// An image of one channel taken by `from` (at its size), as `to` would have taken it from the same
/// place; what lies outside repeats the border. 8-bit or float samples.
cv::Mat undistorted(const cv::Mat& image, const Camera& from, const Camera& to);

/// The same of an image whose lens has this k1 (Brown) beside what `camera` says, at the camera's
/// size; the image itself where it has none.
cv::Mat straightened(const cv::Mat& image, const Camera& camera, double k1);

}  // namespace orbitfuse
