// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include "recon/poses/sfm/held_matches.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {

/// Equal things on several sides of an object are matched with each other: of seven equal drums in
/// a ring, views 60 degrees apart say that they see the same one. Where every one of a model's
/// `views` lies within 15 degrees of azimuth of its station, the turn round the object between two
/// of them is known to 30 degrees; a pair of which each geometry that its matches allow turns about
/// `up` by more than 45 degrees from the model's contradicts the stations too, and is no witness.
/// Turns that change elevations don't count, for nothing holds these against the stations; nor do
/// matches that fix no direction (views that look quite alike). Nothing where stations don't say so
/// of all views. `graph` and `posed` must outlive the answer; `up`: in the world of the poses.
PairQuestion mistaken_pairs(const FeatureGraph& graph, const PosedFrames& posed,
                            const std::optional<StationFit>& stations, std::size_t views,
                            const Eigen::Vector3d& up);

}  // namespace orbitfuse
