// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

inline constexpr float codes_per_octave = 14.5f;  ///< 255 codes reach e^12, the highest density

/// A cell's density in steps of 5 %, for marching.
ORBITFUSE_HOST_DEVICE inline int code_of_density(float density) {
  const float steps = std::round(codes_per_octave * std::log2(1 + density));
  return steps > 0 ? (steps < 255 ? static_cast<int>(steps) : 255) : 0;
}
ORBITFUSE_HOST_DEVICE inline float density_of_code(int code) {
  return std::exp2(static_cast<float>(code) / codes_per_octave) - 1;
}

}  // namespace orbitfuse::nerf
