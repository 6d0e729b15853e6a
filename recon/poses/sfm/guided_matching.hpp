// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "recon/poses/sfm/tracks.hpp"

namespace orbitfuse {

/// What bundle adjustment makes of a model: a model of the same frames, or of fewer.
using Adjuster = std::function<Result<Reconstruction>(Reconstruction)>;

/// Below this many points in common two frames don't hold each other.
constexpr int min_shared_points = 15;

/// The largest set of frames that `edges` connect.
std::vector<bool> largest_part(int count, const std::vector<ViewPair>& edges);

/// Matches within `band_px` (recorded) of the epipolar lines of posed views that look in nearly the
/// same direction: repeated structure fails Lowe's test against the whole image, not against one
/// line of it. Of each view its eight nearest; a pair keeps what it had in `matches` where its
/// lines give less than half of that.
void match_along_lines(const FeatureGraph& graph, const PosedFrames& posed, double band_px,
                       PairMatches& matches);

/// Each frame where the others' points have it.
void pose_by_others(const FeatureGraph& graph, const PairMatches& matches, PosedFrames& posed);

/// Points of the matches, as far as the poses allow `max_error_px` (recorded), adjusted with them;
/// frames that hold no other lose their pose. Errors: quality (no two views hold each other); those
/// of `adjust`.
Result<Reconstruction> adjusted(const FeatureGraph& graph, const PairMatches& matches,
                                double max_error_px, PosedFrames& posed, const Adjuster& adjust);

/// Of all points together, 0 without a view.
double observations_a_view(const Reconstruction& model);

/// Of an adjusted model's poses: the matches that they confirm, and those along their lines.
PairMatches matches_along_own_lines(const FeatureGraph& graph, const PosedFrames& posed);

/// The model's views, poses and lenses with the points of all matches that its poses find along
/// their epipolar lines: several times those that two-view geometry held. To be adjusted.
Reconstruction rematched(const FeatureGraph& graph, const Reconstruction& model);

}  // namespace orbitfuse
