// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

inline constexpr int max_sh = 16;

/// Real spherical harmonics of a unit direction, bands 0..degree-1, zero beyond (16 values).
ORBITFUSE_HOST_DEVICE inline void spherical_harmonics(int degree, const float d[3],
                                                      float out[max_sh]) {
  for (int i = 0; i < max_sh; ++i) out[i] = 0;
  const float x = d[0], y = d[1], z = d[2];
  if (degree < 1) return;
  out[0] = 0.28209479f;
  if (degree < 2) return;
  out[1] = -0.48860251f * y;
  out[2] = 0.48860251f * z;
  out[3] = -0.48860251f * x;
  if (degree < 3) return;
  const float xx = x * x, yy = y * y, zz = z * z;
  out[4] = 1.09254843f * x * y;
  out[5] = -1.09254843f * y * z;
  out[6] = 0.94617470f * zz - 0.31539157f;
  out[7] = -1.09254843f * x * z;
  out[8] = 0.54627421f * (xx - yy);
  if (degree < 4) return;
  out[9] = 0.59004359f * y * (-3 * xx + yy);
  out[10] = 2.89061144f * x * y * z;
  out[11] = 0.45704580f * y * (1 - 5 * zz);
  out[12] = 0.37317633f * z * (5 * zz - 3);
  out[13] = 0.45704580f * x * (1 - 5 * zz);
  out[14] = 1.44530572f * z * (xx - yy);
  out[15] = 0.59004359f * x * (-xx + 3 * yy);
}

}  // namespace orbitfuse::nerf
