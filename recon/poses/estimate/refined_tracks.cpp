// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/refined_tracks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/geometry/pose_error.hpp"
#include "recon/poses/estimate/weakest_joint.hpp"
#include "recon/poses/estimate/weakly_held.hpp"
#include "recon/poses/patches/aligned_tracks.hpp"
#include "recon/poses/sfm/guided_matching.hpp"
#include "recon/poses/sfm/held_matches.hpp"

namespace orbitfuse {
namespace {

/// Observations a view from which on more of them move it little: `hut` (832) came from .029 to
/// .017 % of the extent, `sedan` (809) from .026 to .035; `container` has 186, `fox` 1256.
constexpr double plenty_a_view = 800;
/// Of the matches that the model before explained, what one that is matched again must explain: the
/// two stand for the same features, and one that slid off would lose more.
constexpr double still_explained = 0.98;
/// Of the observations before, what makes it worth an adjustment: `van` gains with 1.19 of them,
/// `transformer` lost with 0.68.
constexpr double more_observations = 1.1;

/// In all: adjusting `fox` on 63,000 takes 8 s on two cores.
constexpr double most_observations = 200'000;
/// Of the observations, what must be aligned: `transformer` (.55) went from .052 to .013 % of the
/// extent, `pump_yard` (.31) from .068 to .120.
constexpr double least_aligned = 0.5;

}  // namespace

RefinedTracks rematched_model(const FeatureGraph& graph, const Reconstruction& model) {
  const double seen = observations_a_view(model);
  if (seen > plenty_a_view) return {};
  RefinedTracks again{rematched(graph, model), {}};
  const double now = observations_a_view(*again.model);
  again.found = fmt::format("{:.0f} observations a view for {:.0f}", now, seen);
  if (now >= more_observations * seen) return again;
  return {std::nullopt, again.found + "; too little to take them"};
}

Result<RefinedTracks> aligned_model(const Reconstruction& model, const std::vector<cv::Mat>& images,
                                    const Progress& progress) {
  const auto none = [](std::string why) { return RefinedTracks{std::nullopt, std::move(why)}; };
  const double seen = observations_a_view(model) * static_cast<double>(model.views.size());
  if (seen > most_observations) return none(fmt::format("{:.0f} observations are too many", seen));
  if (!holds_all_views(model)) return none("some views are in doubt");
  ORBITFUSE_ASSIGN(TrackAlignment aligned, align_tracks(model, images, {}, progress));
  std::string found =
      fmt::format("{:.0f} % moved by {:.2f} px, {} left out, {} more found", 100 * aligned.share(),
                  aligned.rms_shift_px, aligned.left_out, aligned.added);
  if (aligned.share() < least_aligned) return none(found + "; too few to hold the views by them");
  return RefinedTracks{std::move(aligned.model), std::move(found)};
}

void add_confirmed(FeatureGraph& graph, PairMatches confirmed) {
  for (auto& [pair, matches] : confirmed)
    if (matches.size() > graph.verified[pair].size()) graph.verified[pair] = std::move(matches);
}

Reconstruction triangulated(const FeatureGraph& graph, const PosedFrames& posed) {
  TrackOptions options;
  options.max_error_px *= graph.pixel_scale;
  return reconstruction_of(graph, posed, triangulate_tracks(graph, graph.verified, posed, options),
                           Modality::visible);
}

Reconstruction triangulated_again(FeatureGraph graph, const Reconstruction& model) {
  const PosedFrames posed = posed_frames(graph, model);
  add_confirmed(graph, confirmed_matches(graph, posed, confirming_px * graph.pixel_scale));
  return triangulated(graph, posed);
}

double farthest_move(const Reconstruction& model, const Reconstruction& before) {
  std::map<std::string, Rigid3d> stood;
  for (const PosedView& view : before.views) stood[view.name] = view.cam_from_world;
  std::vector<PosePair> pairs;
  for (const PosedView& view : model.views)
    if (const auto it = stood.find(view.name); it != stood.end())
      pairs.push_back({view.cam_from_world, it->second});
  const auto before_from_model = truth_from_estimate(pairs);
  if (!before_from_model) return 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) middle += camera_center(pair.cam_from_truth);
  middle /= static_cast<double>(pairs.size());
  double squares = 0, farthest = 0;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d was = camera_center(pair.cam_from_truth);
    const Eigen::Vector3d now = camera_center(rebase(pair.cam_from_estimate, *before_from_model));
    squares += (was - middle).squaredNorm();
    farthest = std::max(farthest, (now - was).norm());
  }
  return farthest / std::sqrt(squares / static_cast<double>(pairs.size()));
}

BundleOptions aligned_bundle() { return {.loss_scale_px = 0.3, .max_error_px = 1.5}; }

ModelSelection::Better explains_as_much(const FeatureGraph& graph) {
  return [&graph](const Reconstruction& model, const Reconstruction& before) {
    return model.views.size() >= before.views.size() &&
           explained_matches(graph, posed_frames(graph, model)) >=
               still_explained * explained_matches(graph, posed_frames(graph, before));
  };
}

bool holds_all_views(const Reconstruction& model) {
  return weakly_held(model).empty() && !weakest_joint(model).loose();
}

}  // namespace orbitfuse
