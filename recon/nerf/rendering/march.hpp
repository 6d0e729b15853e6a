// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "recon/nerf/field/march_settings.hpp"
#include "recon/nerf/field/occupancy.hpp"
#include "recon/nerf/field/view_rays.hpp"

namespace orbitfuse::nerf {

struct DrawnRay {
  Ray ray;
  float near = 0;  ///< nothing before it is seen, nor before the march's own
  float far = std::numeric_limits<float>::max();  ///< nothing beyond it is seen
  float jitter = 0.5f;                            ///< 0..1, where in its stratum a sample lies
};

inline constexpr int march_lanes = 8;

/// Samples along a ray: t (midpoints) and dt (the occupied length each stands for).
struct Marched {
  int count = 0;
  float t[max_ray_samples], dt[max_ray_samples];
};

/// Samples of up to march_lanes rays, which cross the cells side by side: one ray's next cell
/// depends on its last, so that a single one mostly waits. The cells' densities are the proposal
/// distribution; no network is asked where to look. Rays don't influence each other.
void march(const Occupancy& occupancy, const MarchSettings& settings, const DrawnRay* rays,
           int count, Marched* out);

}  // namespace orbitfuse::nerf
