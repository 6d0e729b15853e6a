// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// Moves levels (medians of some 20 pixels) that neither source has to within a few gray levels of
/// the nearer one's. The correction is smooth within plain regions and may step at edges of the
/// sources, where a step is not seen as one. `passes`: 0 returns `fused`.
Plane settle_levels(const Plane& fused, const Plane& visible, const Plane& thermal, int passes);

}  // namespace orbitfuse::fusion
