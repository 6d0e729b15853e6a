// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/mistaken_pairs.hpp"

#include "recon/poses/global_sfm/relative_pose.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

constexpr double beside_station_deg = 15, off_both_deg = 45;
/// Of a pair's matches, what one geometry must hold to speak for it.
constexpr double most_of_it = 0.5;

}  // namespace

PairQuestion mistaken_pairs(const FeatureGraph& graph, const PosedFrames& posed,
                            const std::optional<StationFit>& stations, std::size_t views) {
  if (!stations || static_cast<std::size_t>(stations->views) < views ||
      !(stations->worst_residual_deg <= beside_station_deg))
    return {};
  return [&graph, &posed](const PairVote& vote) {
    const std::vector<FeatureMatch>& matches = graph.verified.at(vote.pair);
    const std::vector<RelativePose> own = relative_poses(graph, vote.pair, matches, {});
    if (own.empty() || static_cast<double>(own[0].matches.size()) <
                           most_of_it * static_cast<double>(matches.size()))
      return false;
    const Rigid3d second_from_first =
        *posed.poses[at(vote.pair.second)] * posed.poses[at(vote.pair.first)]->inverse();
    return rotation_angle_deg(own[0].second_from_first.rotation, second_from_first.rotation) >
           off_both_deg;
  };
}

}  // namespace orbitfuse
