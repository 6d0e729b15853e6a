// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/detail_confidence.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace orbitfuse::nerf {
cv::Mat blurred(const cv::Mat& values, double sigma) {
  cv::Mat result;
  cv::GaussianBlur(values, result, {}, std::max(0.5, sigma));
  return result;
}

namespace {

/// Pixels at a picture's edge where a source's say grows to its full, as a share of the width: its
/// end isn't seen in the new view then.
constexpr double border = 0.03;
/// The neighbourhood of what a source shows differently, as a share of the width.
constexpr double local_mean = 0.01;

/// Mean difference over a neighbourhood, the largest of the channels; found at the base's size.
cv::Mat local_difference(const cv::Mat& difference, const cv::Mat& known, cv::Size base) {
  cv::Mat small, share;
  cv::resize(difference, small, base, 0, 0, cv::INTER_AREA);
  cv::resize(known, share, base, 0, 0, cv::INTER_AREA);
  const double sigma = local_mean * base.width;
  const cv::Mat sum = blurred(small, sigma), weight = blurred(share, sigma);
  std::vector<cv::Mat> planes;
  cv::split(cv::abs(sum), planes);
  for (std::size_t c = 1; c < planes.size(); ++c) planes[0] = cv::max(planes[0], planes[c]);
  cv::Mat mean = planes[0] / cv::max(weight, 1e-3), result;
  cv::resize(mean, result, difference.size(), 0, 0, cv::INTER_LINEAR);
  return result;
}

}  // namespace

cv::Mat confidence_of(const cv::Mat& difference, const cv::Mat& known, cv::Size base,
                      double unexplained) {
  const cv::Mat local = local_difference(difference, known, base);
  cv::Mat result(difference.size(), CV_8U);
  for (int y = 0; y < result.rows; ++y)
    for (int x = 0; x < result.cols; ++x) {
      const double off = local.at<float>(y, x) / unexplained;
      const int inside =
          std::min(std::min(x, result.cols - 1 - x), std::min(y, result.rows - 1 - y));
      const double ramp = std::min(1.0, inside / std::max(1.0, border * result.cols));
      result.at<uchar>(y, x) =
          cv::saturate_cast<uchar>(255 * known.at<float>(y, x) * ramp * std::exp(-off * off));
    }
  return result;
}

}  // namespace orbitfuse::nerf
