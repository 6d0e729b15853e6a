// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/poses/global_sfm/relative_pose.hpp"

namespace orbitfuse {

struct CenterOptions {
  /// Of an epipolar direction of a few hundred matches, as the length of the difference of units.
  double direction_sigma = 0.05;
  /// Of the orbit: cameras stand at one distance from what they look at, to this share of it.
  double orbit_sigma = 0.15;
};

/// Camera centres whose differences have the directions that the pairs saw, with known rotations,
/// robustly; from an orbit of radius 1 that every camera looks inwards from, which also fixes the
/// scale.
std::vector<Eigen::Vector3d> estimate_centers(const std::vector<Eigen::Quaterniond>& cam_from_world,
                                              const std::vector<RelativePose>& pairs,
                                              const CenterOptions& options);

}  // namespace orbitfuse
