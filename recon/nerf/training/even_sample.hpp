// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

namespace orbitfuse::nerf {

/// Mean of 3x3 pixels (CV_32FC1); none outside the image, beside dead pixels and where 5x5 pixels
/// differ by more than `edge`: there poses decide what is seen.
inline std::optional<double> even_sample(const cv::Mat& image, const Eigen::Vector2d& pixel,
                                         float edge) {
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  if (x < 2 || y < 2 || x + 2 >= image.cols || y + 2 >= image.rows) return std::nullopt;
  float low = image.at<float>(y, x), high = low, sum = 0;
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx) {
      const float v = image.at<float>(y + dy, x + dx);
      if (!std::isfinite(v)) return std::nullopt;
      low = std::min(low, v);
      high = std::max(high, v);
      if (std::abs(dx) < 2 && std::abs(dy) < 2) sum += v;
    }
  if (high - low > edge) return std::nullopt;
  return sum / 9;
}

}  // namespace orbitfuse::nerf
