// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/small_things.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "fusion/best/quartered.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr int opening_side = 15;  // of a quarter of the size: 60 px
// Gray levels of heat: below, a camera's noise and fixed pattern; above, nothing is in doubt.
constexpr float fewest_levels = 8, most_levels = 64;

/// White or black top-hat: how far a small thing stands out.
Plane standing_out(const Plane& image, cv::MorphTypes operation) {
  Plane result;
  cv::morphologyEx(image, result, operation, cv::Mat::ones(opening_side, opening_side, CV_8U));
  return result;
}

Plane share_of(const Plane& height, float least, cv::Size size) {
  const Plane share = cv::min(cv::max((height - least) / (2 * least), 0.0F), 1.0F);
  Plane result;
  cv::resize(share, result, size, 0, 0, cv::INTER_LINEAR);
  return result;
}

}  // namespace

Plane small_heat(const Plane& thermal, float least) {
  if (least <= 0) return Plane::zeros(thermal.size());
  const Plane image = quartered(thermal);
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  const float levels =
      std::clamp(least * static_cast<float>(deviation[0]), fewest_levels, most_levels);
  return share_of(standing_out(image, cv::MORPH_TOPHAT), levels, thermal.size());
}

Plane small_marks(const Plane& visible, float least) {
  if (least <= 0) return Plane::zeros(visible.size());
  const Plane image = quartered(visible);
  return share_of(
      cv::max(standing_out(image, cv::MORPH_TOPHAT), standing_out(image, cv::MORPH_BLACKHAT)),
      least, visible.size());
}

}  // namespace orbitfuse::fusion
