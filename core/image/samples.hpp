// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace orbitfuse {

/// Appends the samples of an image (CV_32FC1, or none at all) that are numbers, row by row.
inline void append_finite(const cv::Mat& image, std::vector<float>& samples) {
  CV_Assert(image.empty() || image.type() == CV_32FC1);
  for (int y = 0; y < image.rows; ++y) {
    const float* row = image.ptr<float>(y);
    std::copy_if(row, row + image.cols, std::back_inserter(samples),
                 [](float v) { return std::isfinite(v); });
  }
}

/// The image no wider than that, its shape kept; itself where it is narrow enough. `how` it shrinks
/// is OpenCV's: cv::INTER_AREA for colours, cv::INTER_NEAREST where samples must not mix.
inline cv::Mat no_wider(const cv::Mat& image, int width_px, int how) {
  if (image.cols <= width_px) return image;
  cv::Mat small;
  cv::resize(image, small, {width_px, std::max(1, image.rows * width_px / image.cols)}, 0, 0, how);
  return small;
}

}  // namespace orbitfuse
