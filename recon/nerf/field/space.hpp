// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "recon/nerf/field/contraction.hpp"

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

}  // namespace orbitfuse::nerf
