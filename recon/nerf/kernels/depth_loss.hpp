// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

/// What is known of a ray's end.
struct KnownDistance {
  float distance = 0;  ///< along the ray, normalised
  float weight = 0;    ///< of the loss on this ray
};

/// -weight * log(mass near the known distance): draws a ray's mass there (after Deng et al. 2022,
/// "Depth-supervised NeRF", whose eq. 5 weighs by the same Gaussian). Adds scale * gradient to
/// dweight and returns the loss.
ORBITFUSE_HOST_DEVICE inline float depth_loss(const KnownDistance& known, int count, const float* t,
                                              const float* dt, const float* weight, float scale,
                                              float* dweight) {
  const float z = known.distance;
  const auto kernel = [&](int i) {
    const float u = (t[i] - z) / (0.01f * z + dt[i]);
    return u * u < 18.0f ? std::exp(-0.5f * u * u) : 0.0f;
  };
  float mass = 0.01f;
  for (int i = 0; i < count; ++i) mass += weight[i] * kernel(i);
  const float slope = -known.weight * scale / mass;
  for (int i = 0; i < count; ++i) dweight[i] += slope * kernel(i);
  return -known.weight * std::log(mass);
}

}  // namespace orbitfuse::nerf
