// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/has_colors.hpp"

#include <algorithm>

namespace orbitfuse {

bool has_colors(const cv::Mat& image) {
  if (image.channels() >= 3 && image.depth() == CV_16U) {
    cv::Mat levels;
    image.convertTo(levels, CV_8U, 1.0 / 257);
    return has_colors(levels);
  }
  if (image.channels() < 3 || image.depth() != CV_8U) return false;
  constexpr int clear_of_compression = 24;  // levels
  constexpr double least_share = 0.02;
  std::size_t colored = 0;
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x, row += image.channels()) {
      const auto [low, high] = std::minmax({row[0], row[1], row[2]});
      colored += high - low > clear_of_compression;
    }
  }
  return static_cast<double>(colored) > least_share * static_cast<double>(image.total());
}

}  // namespace orbitfuse
