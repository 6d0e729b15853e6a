// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/settle_levels.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "fusion/best/plain_regions.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr int reduction = 4, median_px = 5;
constexpr float unseen = 6;  // gray levels: as near to a source's level it is that source's
constexpr Ties ties{.strength = 2, .edge = 6, .sweeps = 40};

Plane levels_of(const Plane& image) {
  Plane reduced, levels;
  const cv::Size size((image.cols + reduction - 1) / reduction,
                      (image.rows + reduction - 1) / reduction);
  cv::resize(image, reduced, size, 0, 0, cv::INTER_AREA);
  cv::medianBlur(reduced, levels, median_px);
  return levels;
}

}  // namespace

Plane settle_levels(const Plane& fused, const Plane& visible, const Plane& thermal, int passes) {
  if (passes <= 0) return fused;
  const Plane v = levels_of(visible), t = levels_of(thermal), own(v.size(), 1.0F);
  Plane result = fused;
  for (int pass = 0; pass < passes; ++pass) {
    Plane move = levels_of(result), wide;
    for (int y = 0; y < move.rows; ++y)
      for (int x = 0; x < move.cols; ++x) {
        const float to_v = v(y, x) - move(y, x), to_t = t(y, x) - move(y, x);
        const float way = std::abs(to_v) < std::abs(to_t) ? to_v : to_t;
        move(y, x) = std::copysign(std::max(0.0F, std::abs(way) - unseen), way);
      }
    cv::resize(within_regions(move, own, v, t, ties), wide, fused.size(), 0, 0, cv::INTER_LINEAR);
    result = result + wide;
  }
  return result;
}

}  // namespace orbitfuse::fusion
