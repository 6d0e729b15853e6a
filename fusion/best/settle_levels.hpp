// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// Moves levels (medians of some 20 pixels) that neither source has to within a few gray levels of
/// the nearer one's; where `marks`, 0..1, to the visible one's; where `heat`, 0..1, up to the
/// thermal one's and never down. The correction is smooth within plain regions and may step at
/// edges of the sources, where a step is not seen as one. All of one size.
Plane settle_levels(const Plane& fused, const Plane& visible, const Plane& thermal,
                    const Plane& heat, const Plane& marks);

}  // namespace orbitfuse::fusion
