// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

// How much of what a recorded view shows beyond the field is detail of what the field shows; the
// rest is something else (PhotoDetail). Internal to recon/nerf.
namespace orbitfuse::nerf {

/// Gaussian, at least half a pixel wide.
cv::Mat blurred(const cv::Mat& values, double sigma);

/// 0..255, CV_8U, of each pixel. `difference` (CV_32F, any channels) is in value ranges, `known`
/// (CV_32F) 1 where there is one; `base` the size that the field was rendered at, `unexplained`
/// DetailOptions'.
cv::Mat confidence_of(const cv::Mat& difference, const cv::Mat& known, cv::Size base,
                      double unexplained);

}  // namespace orbitfuse::nerf
