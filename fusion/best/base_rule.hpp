// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

struct BaseRule {
  float visible_preference;  ///< gray levels
  float brightness_weight;
};

/// Sparse-representation base fusion (Liu, Liu, Wang 2015, section 3.2) with the 2-D DCT in place
/// of a learned dictionary, so no pursuit is needed: every 8x8 patch votes for the source with the
/// larger activity, a pixel's weight is the mean vote of the patches that hold it. Activity of a
/// patch of N = 64 samples:
///   sum of |c_k| over all k but the mean + N (brightness_weight * mean + visible_preference),
/// the last term for the visible source only. Planes of one size, at least 8 x 8.
Plane fuse_base(const Plane& visible, const Plane& thermal, const BaseRule& rule);

}  // namespace orbitfuse::fusion
