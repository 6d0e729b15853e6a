// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace orbitfuse::nerf {

/// Normalised scene space: the region the cameras look at is the unit ball; beyond it space is
/// contracted into the ball of radius 2 (Mip-NeRF 360, eq. 10), so that the ground and the sky
/// keep a finite address.
struct Space {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1;

  Eigen::Vector3d normalized(const Eigen::Vector3d& world) const {
    return (world - center) / radius;
  }
};

/// Contracted position scaled to [0, 1]^3. `x` is normalised; all values are finite for finite x.
inline void contract01(const float x[3], float out[3]) {
  const float n2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
  float s = 1.0f;
  if (n2 > 1.0f) {
    const float inv = 1.0f / std::sqrt(n2);
    s = (2.0f - inv) * inv;
  }
  for (int d = 0; d < 3; ++d) out[d] = x[d] * s * 0.25f + 0.5f;
}

}  // namespace orbitfuse::nerf
