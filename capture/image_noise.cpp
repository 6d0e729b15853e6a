// SPDX-License-Identifier: BSD-3-Clause
#include "capture/image_noise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace orbitfuse {

double white_noise_sigma(const cv::Mat& gray, int stride) {
  CV_Assert(gray.type() == CV_32FC1 && stride > 0);
  std::vector<float> detail;
  for (int y = 0; y + 1 < gray.rows; y += stride) {
    const float *a = gray.ptr<float>(y), *b = gray.ptr<float>(y + 1);
    for (int x = 0; x + 1 < gray.cols; x += stride)
      detail.push_back(std::abs(a[x] - a[x + 1] - b[x] + b[x + 1]) / 2);
  }
  if (detail.empty()) return 0;
  const auto middle = detail.begin() + static_cast<std::ptrdiff_t>(detail.size() / 2);
  std::nth_element(detail.begin(), middle, detail.end());
  constexpr double median_of_gaussian = 0.6745;  // of its absolute values
  return *middle / median_of_gaussian;
}

}  // namespace orbitfuse
