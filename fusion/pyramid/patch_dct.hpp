// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// What an 8x8 patch holds, by its orthonormal 2-D DCT.
struct PatchActivity {
  float structure;  ///< sum of |coefficients| but the mean's
  float sum;        ///< of the samples
};
PatchActivity patch_activity(const Plane& image, int x, int y);

}  // namespace orbitfuse::fusion
