// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/progress.hpp"
#include "recon/poses/sfm/tracks.hpp"

namespace orbitfuse {

struct ResectionOptions {
  /// Correspondences of the found pose; random ones agree with one by half a dozen at most.
  int min_inliers = 20;
  /// Share of them among the correspondences, above what a view of something else reaches.
  double min_inlier_ratio = 0.1;
  /// In pixels of the proxies.
  double max_error_px = 4;
};

/// Poses the frames that have none on the points of those that do: by matches with every posed
/// frame (exact, also those that no two-view geometry held), robustly; the frame with most
/// correspondences first, whose points then help the next. Their guided matches join
/// `graph.verified`. Returns the frames that it posed.
Result<std::vector<int>> resect(FeatureGraph& graph, PosedFrames& posed,
                                const ResectionOptions& options, const Progress& progress);

/// Where the other frames' points have a frame, by its exact matches within a twentieth of the
/// width of where they should be, and how many of those agree there and where it is now.
struct OtherPlace {
  Rigid3d pose;
  int agree_there = 0, agree_here = 0;
};
std::optional<OtherPlace> place_by_others(const FeatureGraph& graph,
                                          const std::vector<FeatureTrack>& tracks,
                                          const PosedFrames& posed, int frame,
                                          const ResectionOptions& options);

/// Where a posed frame stands by the others' share in `tracks`, near where it stands now (points
/// that it misses by more than a twentieth of the width aren't asked): matches found along its own
/// epipolar lines hold a frame where it is, right or not, and these don't. nullopt where nothing is
/// found, or fewer of its exact matches agree with it than with its pose.
std::optional<Rigid3d> resect_by_others(const FeatureGraph& graph,
                                        const std::vector<FeatureTrack>& tracks,
                                        const PosedFrames& posed, int frame,
                                        const ResectionOptions& options);

}  // namespace orbitfuse
