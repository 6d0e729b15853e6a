// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/band_rule.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr int row_block = 16;

Plane sum_of_products(const Plane& a, const Plane& b) {
  Plane sum;
  cv::boxFilter(a.mul(b), sum, CV_32F, {3, 3});
  return sum;
}

/// A small network is surer than it should be: its answer never outweighs all evidence.
constexpr float doubt = 0.01F;

/// p et^2 / (p et^2 + (1 - p) ev^2), by shares of the sum so that nothing under- or overflows.
float thermal_share(float ev, float et, float prior) {
  const float p = doubt + (1 - 2 * doubt) * prior, total = ev + et;
  if (!(total > 0)) return p;
  const float t = et / total, v = ev / total;
  return p * t * t / (p * t * t + (1 - p) * v * v);
}

}  // namespace

Plane fuse_band(const Plane& visible, const Plane& thermal, const Plane& weight, const Plane& prior,
                const BandRule& rule) {
  const Plane ev = sum_of_products(visible, visible), et = sum_of_products(thermal, thermal),
              both = sum_of_products(visible, thermal);
  Plane share(visible.size()), voted, fused(visible.size());
  parallel_blocks(visible.rows, row_block, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < visible.cols; ++x)
        // Running sums may leave a trace below zero.
        share(y, x) =
            thermal_share(std::max(0.0F, ev(y, x)), std::max(0.0F, et(y, x)), prior(y, x));
  });
  cv::boxFilter(share, voted, CV_32F, {rule.vote_px, rule.vote_px});
  parallel_blocks(visible.rows, row_block, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < visible.cols; ++x) {
        const bool alike = 2 * both(y, x) >= rule.match_threshold * (ev(y, x) + et(y, x));
        const float w = alike ? weight(y, x) : voted(y, x);
        fused(y, x) = visible(y, x) + w * (thermal(y, x) - visible(y, x));
      }
  });
  return fused;
}

}  // namespace orbitfuse::fusion
