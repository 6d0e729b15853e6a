// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/global_sfm/global_mapper.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/system/parallel.hpp"
#include "recon/poses/global_sfm/center_estimation.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/sfm/guided_matching.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

PairCandidates candidates_of(const FeatureGraph& graph, const RelativePoseOptions& options) {
  std::vector<ViewPair> pairs;
  for (const auto& [pair, matches] : graph.proposed) pairs.push_back(pair);
  PairCandidates candidates(pairs.size());
  parallel_for(static_cast<int>(pairs.size()),
               [&](int p) { candidates[at(p)] = relative_poses(graph, pairs[at(p)], options); });
  std::erase_if(candidates, [](const auto& of_pair) { return of_pair.empty(); });
  return candidates;
}

/// Both ways round the object where there are stations: the loop says which.
AveragedRotations averaged(const FeatureGraph& graph, const PairCandidates& candidates,
                           const RotationOptions& options) {
  const std::vector<double> elevations = loop_elevations_deg(graph.frames, candidates);
  AveragedRotations best =
      average_rotations(candidates, nominal_rotations(graph.frames, elevations, false), options);
  if (!all_have_stations(graph.frames)) return best;
  AveragedRotations other =
      average_rotations(candidates, nominal_rotations(graph.frames, elevations, true), options);
  return other.cost < best.cost ? other : best;
}

/// Of each pair the candidate whose direction is nearest to the centres', within `max_deg`.
std::vector<RelativePose> by_direction(const PairCandidates& kept,
                                       const std::vector<Eigen::Quaterniond>& rotation,
                                       const std::vector<Eigen::Vector3d>& center, double max_deg) {
  std::vector<RelativePose> chosen;
  for (const auto& of_pair : kept) {
    const RelativePose* best = nullptr;
    double least = max_deg;
    for (const RelativePose& pose : of_pair) {
      const Eigen::Vector3d seen =
          rotation[at(pose.second)].conjugate() * pose.second_from_first.translation;
      const Eigen::Vector3d expected = center[at(pose.first)] - center[at(pose.second)];
      const double off =
          std::atan2(seen.cross(expected).norm(), seen.dot(expected)) * 180 / EIGEN_PI;
      if (off < least) least = off, best = &pose;
    }
    if (best != nullptr) chosen.push_back(*best);
  }
  return chosen;
}

/// The pairs to build on, and the centres that they give.
std::vector<RelativePose> chosen_pairs(const FeatureGraph& graph,
                                       const AveragedRotations& rotations,
                                       const GlobalMapperOptions& options,
                                       std::vector<Eigen::Vector3d>& centers) {
  std::vector<RelativePose> pairs;
  if (all_have_stations(graph.frames)) {
    centers = estimate_centers(rotations.cam_from_world, {}, {});
    pairs =
        by_direction(rotations.kept, rotations.cam_from_world, centers, options.max_direction_deg);
  } else {
    for (const auto& of_pair : rotations.kept) pairs.push_back(of_pair.front());
  }
  centers = estimate_centers(rotations.cam_from_world, pairs, {});
  return pairs;
}

/// Averaged rotations and the centres that go with them, of the frames that the pairs connect.
FramePoses averaged_poses(const AveragedRotations& rotations,
                          const std::vector<Eigen::Vector3d>& centers,
                          const std::vector<ViewPair>& edges) {
  const auto count = static_cast<int>(centers.size());
  const std::vector<bool> inside = largest_part(count, edges);
  FramePoses poses(at(count));
  for (int f = 0; f < count; ++f) {
    if (!inside[at(f)] || !rotations.placed[at(f)]) continue;
    const Eigen::Quaterniond& q = rotations.cam_from_world[at(f)];
    poses[at(f)] = Rigid3d{q, -(q * centers[at(f)])};
  }
  return poses;
}

}  // namespace

Result<GlobalModel> map_globally(FeatureGraph& graph, const Adjuster& adjust,
                                 const GlobalMapperOptions& options, const Progress& progress) {
  GlobalModel result;
  const PairCandidates candidates = candidates_of(graph, options.pairs);
  ORBITFUSE_TRY(progress.check("poses.global"));
  const AveragedRotations rotations = averaged(graph, candidates, options.rotations);
  std::vector<Eigen::Vector3d> centers;
  const std::vector<RelativePose> kept = chosen_pairs(graph, rotations, options, centers);
  result.found = fmt::format("{} of {} pairs have a geometry, the loop confirms {}",
                             candidates.size(), graph.proposed.size(), kept.size());
  PairMatches matches;
  std::vector<ViewPair> edges;
  for (const RelativePose& pair : kept) {
    matches[{pair.first, pair.second}] = pair.matches;
    edges.emplace_back(pair.first, pair.second);
  }
  result.posed = {averaged_poses(rotations, centers, edges), graph.cameras};
  // In pixels of the proxies, from where averaged pairs leave the rays to where features lie; from
  // `guided_from_px` poses are near enough to match along their lines.
  constexpr double guided_from_px = 6, last_px = 2;
  for (const double round_px : {40.0, 12.0, guided_from_px, 4.0, 2.5, last_px}) {
    ORBITFUSE_TRY(progress.check("poses.global"));
    const double max_error_px = round_px * graph.pixel_scale;
    const bool guided = round_px <= guided_from_px;
    if (guided) match_along_lines(graph, result.posed, max_error_px, matches);
    Result<Reconstruction> model = adjusted(graph, matches, max_error_px, result.posed, adjust);
    if (!model && model.error().kind == ErrorKind::cancelled) return tl::unexpected(model.error());
    if (!model) {
      result.found += "; " + model.error().found;
      result.model = {};
      return result;
    }
    result.model = *std::move(model);
    result.posed = posed_frames(graph, result.model);
    if (!guided)
      matches = confirmed_matches(graph, result.posed, std::min(8.0, round_px) * graph.pixel_scale);
    else if (round_px > last_px)
      pose_by_others(graph, matches, result.posed);
  }
  graph.verified = std::move(matches);
  return result;
}

}  // namespace orbitfuse
