// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "recon/nerf/scene.hpp"

// Cameras refined while the field trains (as Lin et al. 2021, "BARF", do by gradients through the
// encoding), at next to no cost: the rays that training draws anyway say by how much the picture
// differs at their pixels, the photo's slope there and the distance to what was seen say how the
// camera's motion would change that, and each view takes the Gauss-Newton step of its rays.
namespace orbitfuse::nerf {

inline constexpr int fewest_pose_rays = 200;    ///< for a step
inline constexpr double poses_move_from = 0.1;  ///< of a run: by then there is form to go by

/// Normal equations of one view's motion x = (shift, turn) in camera axes, normalised units:
/// sum w |slope * motion(x) - (shown - photo)|^2 over its rays.
struct PoseSums {
  std::array<double, 36> normal{};
  std::array<double, 6> right{};
  std::int64_t rays = 0;  ///< as wide as the others: stored as it lies, without padding
  void add(const PoseSums& other);
};

/// A ray through pixel (x, y) of `view` that shows `shown` (channels of the target) at a normalised
/// distance. Pixels at the border or beside dead ones say nothing.
void add_ray(const SceneView& view, int x, int y, const float* shown, float distance, PoseSums& sums);

/// Where refinement has brought a view.
struct RefinedPose {
  std::array<double, 7> cam_from_world{};  ///< quaternion x y z w, translation
  std::array<double, 6> moved{};           ///< sum of its steps
  PoseSums pending;                        ///< of rays since the last one
  Rigid3d pose() const;
};

RefinedPose unmoved(const Rigid3d& cam_from_world);

/// How sure the given poses are, against 200 rays.
struct PosePrior {
  double sigma_turn_rad = 0.01, sigma_shift = 0.01;  ///< scene radii
  /// Of a ray's difference, in units of the span: several times what is seen, because what a field has wrong
  /// is wrong alike in many rays. With 0.05, poses that were right wandered by 0.1 to 0.4 degrees.
  double noise = 0.2;
};

/// The step that the sums ask for, held to the given pose as far as that is sure; no further than 1 degree
/// or 2 % of the scene at a time. False, and the view stays, where fewer than 200 rays say anything or the
/// result is not finite.
bool take_step(const PoseSums& sums, const Space& space, RefinedPose& refined, SceneView& view,
               const PosePrior& prior = {});

}  // namespace orbitfuse::nerf
