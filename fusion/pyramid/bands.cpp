// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pyramid/bands.hpp"

#include <opencv2/imgproc.hpp>

namespace orbitfuse::fusion {

bool silent(const Plane& visible, const Plane& thermal) {
  constexpr double unseen = 0.25;
  return cv::norm(visible, cv::NORM_INF) < unseen && cv::norm(thermal, cv::NORM_INF) < unseen;
}

Plane share_by_magnitude(const Plane& visible, const Plane& thermal) {
  const cv::Mat square = cv::Mat::ones(3, 3, CV_8U);
  cv::Mat v, t;
  cv::dilate(cv::abs(visible), v, square, {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::dilate(cv::abs(thermal), t, square, {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::Mat1b take = v > t;
  // A median of a two-valued image is its majority.
  cv::medianBlur(take, take, 5);
  Plane share;
  take.convertTo(share, CV_32F, 1.0 / 255);
  cv::blur(share, share, {3, 3});
  return share;
}

}  // namespace orbitfuse::fusion
