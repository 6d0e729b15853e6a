// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "core/geometry/transform.hpp"
#include "recon/nerf/field/pose_sums.hpp"

namespace orbitfuse::nerf {

/// Where refinement has brought a view.
struct RefinedPose {
  std::array<double, 7> cam_from_world{};  ///< quaternion x y z w, translation
  std::array<double, 6> moved{};           ///< sum of its steps
  PoseSums pending;                        ///< of rays since the last one
  Rigid3d pose() const;
};

RefinedPose unmoved(const Rigid3d& cam_from_world);

}  // namespace orbitfuse::nerf
