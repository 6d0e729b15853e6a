// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/poses/sfm/tracks.hpp"

namespace orbitfuse {

/// How far a pair's verified matches lie from the epipolar lines of given poses.
struct PairMisses {
  ViewPair pair;
  /// Of an image whose longer side has `missed_side_px` pixels, so that no image's size counts.
  std::vector<float> px;
};
inline constexpr double missed_side_px = 640;

/// Of those `matches` of the graph whose frames both have a pose. Two cameras in one place have no
/// lines: such pairs are left out.
std::vector<PairMisses> line_misses(const FeatureGraph& graph, const PairMatches& matches,
                                    const PosedFrames& posed);

/// The matches that lie within `px`, and all of them.
struct Held {
  std::size_t held = 0, all = 0;
  double share() const {
    return all > 0 ? static_cast<double>(held) / static_cast<double>(all) : 0.0;
  }
};
Held held_of(const PairMisses& misses, double px);
Held held_within(const std::vector<PairMisses>& misses, double px);

/// By frame, of `frames`. Pairs with a frame that `without` marks don't count.
std::vector<Held> held_by_frame(const std::vector<PairMisses>& misses, double px, int frames,
                                const std::vector<bool>& without);

/// Over all matches that lie within `px`: what is farther is no match. 0 without one.
double median_miss_px(const std::vector<PairMisses>& misses, double px);

}  // namespace orbitfuse
