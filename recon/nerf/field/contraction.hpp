// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

/// Contracted position scaled to [0, 1]^3. `x` is normalised; all values are finite for finite x.
ORBITFUSE_HOST_DEVICE inline void contract01(const float x[3], float out[3]) {
  const float n2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
  float s = 1.0f;
  if (n2 > 1.0f) {
    const float inv = 1.0f / std::sqrt(n2);
    s = (2.0f - inv) * inv;
  }
  for (int d = 0; d < 3; ++d) out[d] = x[d] * s * 0.25f + 0.5f;
}

}  // namespace orbitfuse::nerf
