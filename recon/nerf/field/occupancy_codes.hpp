// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

inline constexpr float codes_per_octave = 14.5f;  ///< 255 codes reach e^12, the highest density

/// A cell's density in steps of 5 %, for marching.
inline int code_of_density(float density) {
  const float steps = std::round(codes_per_octave * std::log2(1 + density));
  return steps > 0 ? (steps < 255 ? static_cast<int>(steps) : 255) : 0;
}

/// The least density that has each code, by which a device finds the processor's code: its
/// logarithm may round otherwise, and a resumed training would place its samples elsewhere.
struct CodeThresholds {
  float least[256];
};
inline CodeThresholds code_thresholds() {
  CodeThresholds out;
  for (int code = 0; code < 256; ++code) {
    float below = 0, from = 2 * std::exp2(255 / codes_per_octave);
    for (;;) {
      const float middle = below + 0.5f * (from - below);
      if (middle <= below || middle >= from) break;
      (code_of_density(middle) >= code ? from : below) = middle;
    }
    out.least[code] = code == 0 ? 0 : from;
  }
  return out;
}
ORBITFUSE_HOST_DEVICE inline int code_by(const float least[256], float density) {
  int code = 0;  // the last whose threshold is reached
  for (int step = 128; step > 0; step /= 2)
    if (density >= least[code + step]) code += step;
  return code;
}

ORBITFUSE_HOST_DEVICE inline float density_of_code(int code) {
  return std::exp2(static_cast<float>(code) / codes_per_octave) - 1;
}

}  // namespace orbitfuse::nerf
