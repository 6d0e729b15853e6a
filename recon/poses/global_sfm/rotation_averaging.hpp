// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/session/session.hpp"
#include "recon/poses/global_sfm/relative_pose.hpp"

namespace orbitfuse {

/// Candidates of each pair: at most one of them is right.
using PairCandidates = std::vector<std::vector<RelativePose>>;

struct RotationOptions {
  /// Of a pair's rotation about the truth; five-point geometry of a few hundred matches.
  double pair_sigma_deg = 2;
  /// A pair that misses the loop by more is thrown out.
  double max_pair_residual_deg = 6;
  /// Of the nominal rotations: the camera looks at the object from its station.
  double prior_sigma_deg = 12;
  /// Robust scale, from the first pass to the last: nominal stations are off by ten degrees, and
  /// no wrong pair may win before the loops have closed.
  double first_scale_deg = 25, last_scale_deg = 4;
};

struct AveragedRotations {
  std::vector<Eigen::Quaterniond> cam_from_world;
  std::vector<bool> placed;  ///< false: no kept pair reaches the frame
  PairCandidates kept;       ///< those that the loop confirms; no pair is empty
  double cost = 0;
};

/// Where cameras at these stations would look from, level and aimed at the axis: rotations in a
/// z-up world. `elevations_deg` by loop. Frames without a station have none.
std::vector<std::optional<Eigen::Quaterniond>> nominal_rotations(
    const std::vector<const FrameRecord*>& frames, const std::vector<double>& elevations_deg,
    bool clockwise);

/// The elevation of each loop: as declared, else from the axes that neighbours of the loop turn
/// about, which is the vertical; 20 degrees where nothing says.
std::vector<double> loop_elevations_deg(const std::vector<const FrameRecord*>& frames,
                                        const PairCandidates& candidates);

/// Robust averaging of all pairs on SO(3), from the prior where every frame has one, else along the
/// tree of the strongest pairs.
AveragedRotations average_rotations(const PairCandidates& candidates,
                                    const std::vector<std::optional<Eigen::Quaterniond>>& prior,
                                    const RotationOptions& options);

}  // namespace orbitfuse
