// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/best/best.hpp"

namespace orbitfuse::fusion {

/// What keeps levels near an edge those of a source. No options: they belong together, and
/// bench/fusion chose them. none() is the method without.
struct HaloRule {
  float coherence = 3000;  ///< BaseRule
  float decision = 8;      ///< BaseRule
  float lean = 0.15F;      ///< BaseRule
  float pull = 8;          ///< BandMix::base_pull
  float opposite = 8;      ///< BandMix::opposite_pull
  float least_heat = 32;   ///< gray levels, of compact_heat(); below 0: nothing counts as such
  int passes = 1;          ///< of settle_levels()

  static HaloRule none() { return {0, 0, 0, 0, 0, -1, 0}; }
};

/// As fuse_best() with its own rule.
Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options,
                        const HaloRule& halo, BestReport* report);

}  // namespace orbitfuse::fusion
