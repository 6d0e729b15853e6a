// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// How far a pixel belongs to something narrower than some 60 px that only one source may have,
/// 0..1. The ground round it is plain and says nothing of it: without this what decides the ground
/// would hide the thing.

/// Brighter in the thermal image than all round it, by `least` standard deviations of that image (8
/// to 64 gray levels) for 0 and three times as much for 1. 0 everywhere for `least` 0.
Plane small_heat(const Plane& thermal, float least);

/// Brighter or darker in the visible image than all round it, by `least` gray levels for 0 and
/// three times as many for 1. 0 everywhere for `least` 0.
Plane small_marks(const Plane& visible, float least);

}  // namespace orbitfuse::fusion
