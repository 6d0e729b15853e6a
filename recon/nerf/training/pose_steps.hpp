// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "recon/nerf/field/refined_pose.hpp"
#include "recon/nerf/training/scene.hpp"

// Cameras refined while the field trains (as Lin et al. 2021, "BARF", do by gradients through the
// encoding), at next to no cost: the rays that training draws anyway say by how much the picture
// differs at their pixels, the photo's slope there and the distance to what was seen say how the
// camera's motion would change that, and each view takes the Gauss-Newton step of its rays.
namespace orbitfuse::nerf {

inline constexpr int fewest_pose_rays = 200;    ///< for a step
inline constexpr double poses_move_from = 0.1;  ///< of a run: by then there is form to go by

/// A ray through pixel (x, y) of `view` that shows `shown` (channels of the target) at a normalised
/// distance. Pixels at the border or beside dead ones say nothing.
void add_ray(const NormalisedView& view, int x, int y, const float* shown, float distance,
             PoseSums& sums);

/// How sure the given poses are, against 200 rays.
struct PosePrior {
  double sigma_turn_rad = 0.01, sigma_shift = 0.01;  ///< scene radii
  /// Of a ray's difference, in units of the span: several times what is seen, because what a field
  /// has wrong is wrong alike in many rays. With 0.05, poses that were right wandered by 0.1 to 0.4
  /// degrees.
  double noise = 0.2;
};

/// The step that the sums ask for, held to the given pose as far as that is sure; no further than 1
/// degree or 2 % of the scene at a time. False, and the view stays, where fewer than 200 rays say
/// anything or the result is not finite.
bool take_step(const PoseSums& sums, const Space& space, RefinedPose& refined, NormalisedView& view,
               const PosePrior& prior = {});

}  // namespace orbitfuse::nerf
