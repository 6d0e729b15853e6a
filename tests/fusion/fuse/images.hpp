// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace orbitfuse::testing {

struct NamedImage {
  std::string name;
  cv::Mat1b image;
};

inline cv::Mat1b noise(cv::Size size, std::uint64_t seed) {
  cv::Mat1b image(size);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

inline cv::Mat1b ramp(cv::Size size) {
  cv::Mat1b image(size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) image(y, x) = static_cast<uchar>(255 * x / size.width);
  return image;
}

inline cv::Mat1b checkerboard(cv::Size size) {
  cv::Mat1b image(size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) image(y, x) = (x + y) % 2 ? 255 : 0;
  return image;
}

/// Images on which ratios, logarithms and covariances are undefined.
inline std::vector<NamedImage> awkward_images(cv::Size size) {
  return {{"black", cv::Mat1b(size, 0)},
          {"white", cv::Mat1b(size, 255)},
          {"constant", cv::Mat1b(size, 97)},
          {"ramp", ramp(size)},
          {"inverted ramp", 255 - ramp(size)},
          {"checkerboard", checkerboard(size)},
          {"noise", noise(size, 5)}};
}

}  // namespace orbitfuse::testing
