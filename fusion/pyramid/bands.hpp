// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

// Which source gives a coefficient of a high-pass band.
namespace orbitfuse::fusion {

/// Neither band exceeds a quarter of a gray level anywhere: no choice between them can be seen.
bool silent(const Plane& visible, const Plane& thermal);

/// Weight of the visible coefficient, 0..1: the larger maximum of |.| over 3x3 chooses, the
/// majority of 5x5 choices holds (reference: 3x3), which removes lone switches, and choices are
/// averaged over 3x3, so that a border between sources is a ramp instead of a seam.
Plane share_by_magnitude(const Plane& visible, const Plane& thermal);

}  // namespace orbitfuse::fusion
