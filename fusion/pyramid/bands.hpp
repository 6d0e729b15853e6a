// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

// Which source gives a coefficient of a high-pass band.
namespace orbitfuse::fusion {

/// 255 where the visible coefficient is taken: the larger maximum of |.| over 3x3, then the
/// majority of 3x3 (more than 4 of 9), which removes lone switches.
cv::Mat1b choose_by_magnitude(const Plane& visible, const Plane& thermal);

/// Coefficients taken by `take_visible`.
Plane choose(const Plane& visible, const Plane& thermal, const cv::Mat1b& take_visible);

}  // namespace orbitfuse::fusion
