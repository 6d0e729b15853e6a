// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/mistaken_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "recon/poses/global_sfm/relative_pose.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

constexpr double beside_station_deg = 15, off_both_deg = 45;
/// Of a pair's matches, what one geometry must hold to speak for it.
constexpr double most_of_it = 0.5;

/// How far round `axis` a rotation goes, 0 to 180.
double turn_about_deg(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& axis) {
  const double half = std::atan2(rotation.vec().dot(axis), rotation.w());
  return std::abs(std::remainder(2 * half * 180 / std::numbers::pi, 360.0));
}

}  // namespace

PairQuestion mistaken_pairs(const FeatureGraph& graph, const PosedFrames& posed,
                            const std::optional<StationFit>& stations, std::size_t views,
                            const Eigen::Vector3d& up) {
  if (!stations || static_cast<std::size_t>(stations->views) < views ||
      !(stations->worst_residual_deg <= beside_station_deg))
    return {};
  return [&graph, &posed, up](const PairVote& vote) {
    const std::vector<FeatureMatch>& matches = graph.verified.at(vote.pair);
    const std::vector<RelativePose> own =
        relative_poses(graph, posed.cameras, vote.pair, matches, {});
    if (own.empty() || static_cast<double>(own[0].matches.size()) <
                           most_of_it * static_cast<double>(matches.size()))
      return false;
    const Eigen::Quaterniond &first = posed.poses[at(vote.pair.first)]->rotation,
                             &second = posed.poses[at(vote.pair.second)]->rotation;
    return std::all_of(own.begin(), own.end(), [&](const RelativePose& pose) {
      // Of the world between the two as the model has them; none where the pair agrees.
      const Eigen::Quaterniond off = second.conjugate() * pose.second_from_first.rotation * first;
      return turn_about_deg(off, up) > off_both_deg;
    });
  };
}

}  // namespace orbitfuse
