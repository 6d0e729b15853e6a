// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

struct BaseRule {
  float visible_preference;  ///< gray levels
  float brightness_weight;
  float coherence;  ///< of neighbours without an edge between them, against a sample's own votes
  float decision;   ///< how steeply a share of the votes becomes a choice; 0: it stays a share
  float lean;  ///< of that choice, to the visible source: where votes are even a level people know
};

struct FusedBase {
  Plane level;
  Plane weight;  ///< 0..1, of the visible source
};

/// Sparse-representation base fusion (Liu, Liu, Wang 2015, section 3.2) with the 2-D DCT in place
/// of a learned dictionary, so no pursuit is needed: every 8x8 patch votes for the source with the
/// larger activity, a pixel's weight is the mean vote of the patches that hold it. Activity of a
/// patch of N = 64 samples:
///   sum of |c_k| over all k but the mean + N (brightness_weight * mean + visible_preference),
/// the last term for the visible source only. Planes of one size, at least 8 x 8.
///
/// A patch beside an edge votes by what lies behind it, and a mean of votes is a level of neither
/// source: a halo. So that a plain region becomes one source's, the weights agree within regions
/// (plain_regions.hpp), the more the nearer the sources' levels are; then they are decided by the
/// logistic function 1 / (1 + exp(-2 decision (w - 1/2 + lean))).
FusedBase fuse_base(const Plane& visible, const Plane& thermal, const BaseRule& rule);

}  // namespace orbitfuse::fusion
