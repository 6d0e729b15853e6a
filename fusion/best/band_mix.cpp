// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/band_mix.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/hal/hal.hpp>
#include <vector>

#include "core/system/parallel.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr float nothing = 1e-4F;     // gray levels squared; far below what a sensor resolves
constexpr float darkest_level = 10;  // gray levels; ratios of levels below say nothing
constexpr float largest_gain = 1.5F;

float above_dark(float level) { return std::max(0.0F, level) + darkest_level; }

}  // namespace

Plane mix_band(const BandSource& visible, const BandSource& thermal, const Plane& common,
               const Plane& level, const Plane& visible_share, const BandMix& rule) {
  Plane fused(level.size());
  parallel_blocks(level.rows, 32, [&](int begin, int end) {
    const int n = level.cols;
    std::vector<float> power(static_cast<std::size_t>(n));
    for (int y = begin; y < end; ++y) {
      const float *ev = visible.energy[y], *et = thermal.energy[y], *bv = visible.band[y],
                  *bt = thermal.band[y];
      const float *lv = visible.level[y], *lt = thermal.level[y], *lf = level[y],
                  *b = visible_share[y], *c = common[y];
      float *p = power.data(), *out = fused[y];
      // (E_t / E_v)^exponent, by logarithms: a whole row at a time is many times faster than pow.
      for (int x = 0; x < n; ++x) p[x] = (et[x] + nothing) / (ev[x] + nothing);
      cv::hal::log32f(p, p, n);
      for (int x = 0; x < n; ++x) {
        const float strengths = std::sqrt(ev[x]) * std::sqrt(et[x]) + nothing;
        const float opposite = std::clamp(-c[x] / strengths, 0.0F, 1.0F);
        const float pull = rule.base_pull + rule.opposite_pull * opposite;
        p[x] = std::clamp(rule.exponent * p[x] - pull * (2 * b[x] - 1), -80.0F, 80.0F);
      }
      cv::hal::exp32f(p, p, n);
      for (int x = 0; x < n; ++x) {
        const float w = 1 / (1 + p[x]), band = bt[x] + w * (bv[x] - bt[x]);
        const float own = above_dark(lt[x] + w * (lv[x] - lt[x]));
        const float gain = 1 + rule.contrast_kept * (above_dark(lf[x]) / own - 1);
        out[x] = lf[x] + std::clamp(gain, 1 / largest_gain, largest_gain) * band;
      }
    }
  });
  return fused;
}

}  // namespace orbitfuse::fusion
