// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pyramid/bands.hpp"

#include <opencv2/imgproc.hpp>

namespace orbitfuse::fusion {

cv::Mat1b choose_by_magnitude(const Plane& visible, const Plane& thermal) {
  const cv::Mat square = cv::Mat::ones(3, 3, CV_8U);
  cv::Mat v, t;
  cv::dilate(cv::abs(visible), v, square, {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::dilate(cv::abs(thermal), t, square, {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::Mat1b take = v > t;
  // A median of a two-valued image is its majority.
  cv::medianBlur(take, take, 3);
  return take;
}

Plane choose(const Plane& visible, const Plane& thermal, const cv::Mat1b& take_visible) {
  Plane result = thermal.clone();
  visible.copyTo(result, take_visible);
  return result;
}

}  // namespace orbitfuse::fusion
