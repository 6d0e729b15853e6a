// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/best/best.hpp"

namespace orbitfuse::fusion {

/// What keeps levels near an edge those of a source, and small things what they are in the source
/// that has them. No options: they belong together, and bench/fusion --halo chose them by
/// cross-validation. none() is the method without.
struct HaloRule {
  float coherence = 3000;  ///< BaseRule
  float decision = 8;      ///< BaseRule
  float lean = 0.15F;      ///< BaseRule
  float pull = 8;          ///< BandMix::base_pull
  float opposite = 8;      ///< BandMix::opposite_pull
  float least_heat =
      1.5F;  ///< standard deviations of the thermal image, of small_heat(); 0: nothing counts
  float least_mark = 64;  ///< gray levels, of small_marks(); 0: nothing counts
  bool settled = true;    ///< settle_levels()

  static HaloRule none() { return {0, 0, 0, 0, 0, 0, 0, false}; }
};

/// As fuse_best() with its own rule.
Result<Plane> fuse_best(const Plane& visible, const Plane& thermal, const BestOptions& options,
                        const HaloRule& halo, BestReport* report);

}  // namespace orbitfuse::fusion
