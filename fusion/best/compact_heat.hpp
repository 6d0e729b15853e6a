// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// 0..1: how far a pixel belongs to something brighter in the thermal image than all round it and
/// less than 60 pixels wide (white top-hat, Serra 1982): 0 up to `least` gray levels above, 1 from
/// three times as many. A person or a bearing is that, a street under a cold sky is not. Negative
/// `least`: 0 everywhere.
Plane compact_heat(const Plane& thermal, float least);

}  // namespace orbitfuse::fusion
