// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace orbitfuse {

/// Standard deviation of an image's white noise, from the median of its finest diagonal
/// differences, in which edges are few (Donoho, IEEE Trans. Inf. Theory 1995).
/// `gray`: CV_32FC1; every `stride`-th pixel of every `stride`-th row is looked at. 0 of an image
/// under 2x2.
double white_noise_sigma(const cv::Mat& gray, int stride);

/// A thermal image (CV_16UC1) with its dead pixels, 0, filled from around them, so that they make
/// no edges; any other image, and one without a live pixel, as it is.
cv::Mat without_dead_pixels(const cv::Mat& image);

}  // namespace orbitfuse
