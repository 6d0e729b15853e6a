// SPDX-License-Identifier: BSD-3-Clause
#include "capture/image_quality/image_noise.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/numeric/median.hpp"

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
  return sigma_of_median * static_cast<double>(median_in(detail));
}

cv::Mat without_dead_pixels(const cv::Mat& image) {
  if (image.type() != CV_16UC1) return image;
  const int dead = static_cast<int>(image.total()) - cv::countNonZero(image);
  if (dead == 0 || dead == static_cast<int>(image.total())) return image;
  cv::Mat values, known = image != 0;
  image.convertTo(values, CV_32F);
  known.convertTo(known, CV_32F, 1.0 / 255);
  // Means of what is known around, ever wider: smooth, and close to the border's values.
  for (int side = 3; cv::countNonZero(known) < static_cast<int>(known.total());
       side = 2 * side + 1) {
    cv::Mat sum, weight;
    cv::boxFilter(values, sum, CV_32F, {side, side}, {-1, -1}, false, cv::BORDER_CONSTANT);
    cv::boxFilter(known, weight, CV_32F, {side, side}, {-1, -1}, false, cv::BORDER_CONSTANT);
    const cv::Mat fillable = (known == 0) & (weight > 0.5);
    cv::Mat means;
    cv::divide(sum, weight, means);
    means.copyTo(values, fillable);
    known.setTo(1, fillable);
  }
  cv::Mat filled;
  values.convertTo(filled, CV_16U);
  return filled;
}

}  // namespace orbitfuse
