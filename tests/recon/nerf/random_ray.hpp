// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "recon/nerf/field/view_rays.hpp"

namespace orbitfuse::nerf::test {

/// From a place up to `reach` off on each axis, in any direction; what else a ray has is left.
inline void draw_ray(cv::RNG& random, float reach, Ray& ray) {
  Eigen::Vector3f direction;
  for (int d = 0; d < 3; ++d) direction[d] = static_cast<float>(random.gaussian(1));
  direction.normalize();
  for (int d = 0; d < 3; ++d) {
    ray.origin[d] = random.uniform(-reach, reach);
    ray.direction[d] = direction[d];
  }
}

}  // namespace orbitfuse::nerf::test
