// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

inline constexpr int density_outputs = 16;  ///< log density and 15 features for the colour network
inline constexpr int color_inputs = 32;     ///< the density network's outputs and 16 harmonics
inline constexpr int color_outputs = 16;    ///< 3 or 1 used; padded for the kernels
inline constexpr float log_density_bias = -1.0f;
inline constexpr float max_log_density = 12.0f;

/// sigma = exp(clamped log density).
ORBITFUSE_HOST_DEVICE inline float density_of(float log_density) {
  constexpr float least = -20.0f;
  const float biased = log_density + log_density_bias;
  const float bounded = biased < least ? least : biased;
  return std::exp(bounded > max_log_density ? max_log_density : bounded);
}

}  // namespace orbitfuse::nerf
