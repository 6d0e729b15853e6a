// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

struct BandRule {
  float match_threshold;
  int vote_px;  ///< odd
};

/// One band of both sources. E = energy over 3x3, match = 2 sum v t / (E_v + E_t).
/// match >= threshold: weighted by `weight` (Liu et al. 2018, eq. 9). Below, where the paper takes
/// the larger energy (eq. 10), ours weighs by the mean over vote_px x vote_px of
///   p E_t^2 / (p E_t^2 + (1 - p) E_v^2),
/// p = `prior` for thermal, kept off 0 and 1: the hard switch makes seams that Qcv and SSIM punish,
/// and knows nothing of what the network saw. Without energy in either band p counts. All planes of
/// one size.
Plane fuse_band(const Plane& visible, const Plane& thermal, const Plane& weight, const Plane& prior,
                const BandRule& rule);

}  // namespace orbitfuse::fusion
