// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/transform.hpp"

namespace orbitfuse::nerf {

/// Normal equations of one view's motion x = (shift, turn) in camera axes, normalised units:
/// sum w |slope * motion(x) - (shown - photo)|^2 over its rays.
struct PoseSums {
  std::array<double, 36> normal{};
  std::array<double, 6> right{};
  std::int64_t rays = 0;  ///< as wide as the others: stored as it lies, without padding
  void add(const PoseSums& other);
};

/// Where refinement has brought a view.
struct RefinedPose {
  std::array<double, 7> cam_from_world{};  ///< quaternion x y z w, translation
  std::array<double, 6> moved{};           ///< sum of its steps
  PoseSums pending;                        ///< of rays since the last one
  Rigid3d pose() const;
};

RefinedPose unmoved(const Rigid3d& cam_from_world);

}  // namespace orbitfuse::nerf
