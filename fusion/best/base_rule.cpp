// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/base_rule.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"
#include "fusion/best/plain_regions.hpp"
#include "fusion/pyramid/patch_dct.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr int patch_side = 8, samples = patch_side * patch_side;

float activity(const Plane& image, int x, int y, float brightness_weight) {
  const PatchActivity patch = patch_activity(image, x, y);
  return patch.structure + brightness_weight * std::max(0.0F, patch.sum);
}

/// Weights that agree within plain regions; what decides is where the levels are far apart.
Plane coherent(const Plane& share, const Plane& visible, const Plane& thermal, float coherence) {
  constexpr float apart = 64, least_own = 0.05F;  // gray levels
  const Plane gap = cv::abs(visible - thermal) / apart;
  const Plane own = cv::min(gap.mul(gap), 1.0F) + least_own;
  return within_regions(share, own, visible, thermal,
                        {.strength = coherence, .edge = 20, .sweeps = 200});
}

}  // namespace

FusedBase fuse_base(const Plane& visible, const Plane& thermal, const BaseRule& rule) {
  // A vote lies at its patch's last sample; outside there are no patches and no votes.
  Plane votes = Plane::zeros(visible.size()), patches = Plane::zeros(visible.size());
  const int rows = visible.rows - patch_side + 1, columns = visible.cols - patch_side + 1;
  parallel_blocks(rows, 4, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < columns; ++x) {
        const float v =
            activity(visible, x, y, rule.brightness_weight) + samples * rule.visible_preference;
        const float t = activity(thermal, x, y, rule.brightness_weight);
        votes(y + patch_side - 1, x + patch_side - 1) = v > t ? 1.0F : v < t ? 0.0F : 0.5F;
        patches(y + patch_side - 1, x + patch_side - 1) = 1;
      }
  });
  const auto sums_of = [](const Plane& plane) {
    Plane sums;
    cv::boxFilter(plane, sums, CV_32F, {patch_side, patch_side}, {0, 0}, false,
                  cv::BORDER_CONSTANT);
    return sums;
  };
  Plane weight = sums_of(votes) / sums_of(patches);
  if (rule.coherence > 0) weight = coherent(weight, visible, thermal, rule.coherence);
  if (rule.decision > 0)
    for (float& w : weight) w = 1 / (1 + std::exp(-2 * rule.decision * (w - 0.5F + rule.lean)));
  return {thermal + weight.mul(visible - thermal), weight};
}

}  // namespace orbitfuse::fusion
