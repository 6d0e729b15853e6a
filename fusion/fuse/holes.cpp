// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/holes.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "fusion/pyramid/pyramid.hpp"

namespace orbitfuse {

using fusion::Plane;

Plane filled(const Plane& image, const cv::Mat1b& valid) {
  Plane weight, weighted;
  valid.convertTo(weight, CV_32F, 1.0 / 255);
  weighted = image.mul(weight);
  weighted.setTo(0, ~valid);
  const int levels = fusion::pyramid_levels(image.size(), 16, 1);
  const auto weights = fusion::gaussian_pyramid(weight, levels),
             sums = fusion::gaussian_pyramid(weighted, levels);
  Plane result;
  for (int i = levels; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    Plane mean = sums[k] / cv::max(weights[k], 1e-6F);
    if (result.empty()) {
      result = mean;
      continue;
    }
    Plane coarse;
    cv::pyrUp(result, coarse, mean.size());
    const Plane w = i == 0 ? weights[k] : Plane(cv::min(weights[k] * 4, 1.0F));
    result = coarse + w.mul(mean - coarse);
  }
  image.copyTo(result, valid);
  return result;
}

Plane feathered(const cv::Mat1b& valid) {
  constexpr double reach =
      1.0 / 80;  // of the width: the ramp is seen as soft, and no wider than that
  Plane share, weight;
  valid.convertTo(share, CV_32F, 1.0 / 255);
  cv::GaussianBlur(share, weight, {}, std::max(1.0, reach * valid.cols), 0, cv::BORDER_REPLICATE);
  // At a straight edge half of the window is valid.
  weight = cv::min(cv::max(2 * weight - 1, 0), 1);
  weight.setTo(0, valid == 0);
  return weight;
}

cv::Rect needed_part(const cv::Mat1b& valid) {
  constexpr int reach = 64, grid = 64;  // px; four levels of pyramid, and half a patch of its base
  constexpr double worth = 0.8;
  const cv::Rect box = cv::boundingRect(valid);
  const auto down = [](int i) { return std::max(0, i - reach) / grid * grid; };
  const cv::Point first(down(box.x), down(box.y));
  const auto up = [](int end, int size) {
    return std::min(size, (end + reach + grid - 1) / grid * grid);
  };
  const cv::Rect part(
      first, cv::Point(up(box.x + box.width, valid.cols), up(box.y + box.height, valid.rows)));
  // A strip of the last grid cell may be too narrow for a pyramid.
  const bool large_enough = part.width >= fusion::min_side_px && part.height >= fusion::min_side_px;
  return large_enough && part.area() < worth * static_cast<double>(valid.total())
             ? part
             : cv::Rect({}, valid.size());
}

}  // namespace orbitfuse
