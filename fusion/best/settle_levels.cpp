// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/settle_levels.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "fusion/best/plain_regions.hpp"
#include "fusion/best/quartered.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr int median_px = 5;  // of a quarter of the size
constexpr float unseen = 4;   // gray levels: as near to a source's level it is that source's
constexpr Ties ties{.strength = 2, .edge = 12, .sweeps = 15};

Plane levels_of(const Plane& image) {
  Plane levels;
  cv::medianBlur(quartered(image), levels, median_px);
  return levels;
}

float seen_part(float way) { return std::copysign(std::max(0.0F, std::abs(way) - unseen), way); }

}  // namespace

Plane settle_levels(const Plane& fused, const Plane& visible, const Plane& thermal,
                    const Plane& heat, const Plane& marks) {
  const Plane v = levels_of(visible), t = levels_of(thermal), f = levels_of(fused),
              hot = quartered(heat), mark = quartered(marks), own(f.size(), 1.0F);
  Plane move(f.size()), wide;
  for (int y = 0; y < f.rows; ++y)
    for (int x = 0; x < f.cols; ++x) {
      const float to_v = v(y, x) - f(y, x), to_t = t(y, x) - f(y, x);
      float way = seen_part(std::abs(to_v) < std::abs(to_t) ? to_v : to_t);
      way += mark(y, x) * (seen_part(to_v) - way);
      way += hot(y, x) * (std::max(0.0F, seen_part(to_t)) - way);
      move(y, x) = way;
    }
  cv::resize(within_regions(move, own, v, t, ties), wide, fused.size(), 0, 0, cv::INTER_LINEAR);
  return fused + wide;
}

}  // namespace orbitfuse::fusion
