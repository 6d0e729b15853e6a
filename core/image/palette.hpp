// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// Temperatures shown by a palette from its first to its last colour.
struct TemperatureSpan {
  double low_k = 0, high_k = 0;
};

/// "inferno" (default), "ironbow", "white-hot", "black-hot", "rainbow".
std::vector<std::string> palette_names();

/// 256 BGR colours, CV_8UC3 1x256; usage error with the known names otherwise.
Result<cv::Mat> palette(const std::string& name);

/// CV_32FC1 kelvin to CV_8UC3 BGR; NaN becomes black.
cv::Mat colorize(const cv::Mat& kelvin, TemperatureSpan span, const cv::Mat& palette_bgr);

/// One span for all images: the given percentiles of all finite samples, at least 0.5 K wide.
TemperatureSpan common_span(const std::vector<cv::Mat>& kelvin_images, double low_percentile = 0.5,
                            double high_percentile = 99.5);

}  // namespace orbitfuse
