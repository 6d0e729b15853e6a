// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/progress.hpp"
#include "recon/poses/global_sfm/rotation_averaging.hpp"
#include "recon/poses/sfm/guided_matching.hpp"

namespace orbitfuse {

struct GlobalMapperOptions {
  RelativePoseOptions pairs;
  RotationOptions rotations;
  /// Where stations say that the cameras look inwards from an orbit, a pair whose direction leaves
  /// it by more is thrown out: one pillar taken for the next leaves the rotation as it is.
  double max_direction_deg = 35;
};

struct GlobalModel {
  PosedFrames posed;
  Reconstruction model;  ///< adjusted; no views where nothing was found
  std::string found;     ///< figures, in words
};

/// All views at once, where the incremental mapper finds no pair to begin with or follows a wrong
/// one: relative poses of the pairs (several where structure repeats), rotations averaged with the
/// stations as prior, pairs that the loop contradicts thrown out, centres, tracks, and bundle
/// adjustment without the prior. Matches that the poses confirm replace `graph.verified`.
/// Errors: cancelled.
Result<GlobalModel> map_globally(FeatureGraph& graph, const Adjuster& adjust,
                                 const GlobalMapperOptions& options, const Progress& progress);

}  // namespace orbitfuse
