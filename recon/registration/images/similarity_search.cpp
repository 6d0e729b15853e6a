// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/similarity_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/numeric/median.hpp"
#include "core/option_range.hpp"
#include "recon/registration/images/similarity_round.hpp"

namespace orbitfuse {
namespace {

constexpr int search_width_px = 128;
/// Of a start's step from the clouds' answer: beyond that they would not have met.
constexpr double farthest = 3;
/// Of the scene's diameter: shifted by more than its radius, hardly anything of it would meet.
constexpr double farthest_shift = 0.5;

/// From a start to where its basin is known, and on to the basin's floor.
std::vector<RenderRound> opening_rounds() {
  return {
      {.width_px = search_width_px, .search_px = 24, .patch_search_px = 11, .patch_radius_px = 18},
      {.width_px = search_width_px, .search_px = 16, .patch_search_px = 10, .patch_radius_px = 15}};
}
constexpr RenderRound closing_round{
    .width_px = search_width_px, .search_px = 7, .patch_search_px = 7, .patch_radius_px = 10};
constexpr RenderRound judging_round{
    .width_px = search_width_px, .search_px = 3, .patch_search_px = 4, .patch_radius_px = 8};

/// A place on its way, and how well the images support it.
struct ImageCandidate {
  Similarity3d visible_from_thermal;
  double support = 0;                    ///< agreement of edges times patches in place
  double share = 0;                      ///< of the patches, in place
  std::vector<ScenePatch> patches = {};  ///< of its last round
};

struct Evidence {
  const SceneRenderer& visible;
  std::vector<cv::Mat> images;
  std::vector<PosedView> thermal;
  const Progress& progress;
};

/// Moves by one round; false where the images show too little.
Result<bool> step(const Evidence& seen, const RenderRound& round, ImageCandidate& candidate) {
  ORBITFUSE_ASSIGN(SimilarityRound found,
                   match_scene(seen.visible, seen.images, seen.thermal,
                               candidate.visible_from_thermal, round, seen.progress));
  if (found.patches.size() < fewest_patches) {
    candidate.support = 0;
    return false;
  }
  const Similarity3d moved =
      agreed_similarity(found.patches, candidate.visible_from_thermal.inverse());
  const int matches = found.matches(moved);
  candidate.visible_from_thermal = moved.inverse();
  candidate.share = matches / static_cast<double>(found.patches.size());
  candidate.support = std::max(0.0, found.agreement) * matches;
  candidate.patches = std::move(found.patches);
  return moved.is_finite() && moved.scale > 0;
}

Status open(const Evidence& seen, ImageCandidate& candidate) {
  for (const RenderRound& round : opening_rounds()) {
    ORBITFUSE_ASSIGN(const bool moves, step(seen, round, candidate));
    if (!moves) break;
  }
  return {};
}

Status close(const Evidence& seen, ImageCandidate& candidate) {
  if (!(candidate.support > 0)) return {};
  for (const RenderRound& round : {closing_round, judging_round})
    ORBITFUSE_TRY(step(seen, round, candidate));
  return {};
}

/// The middle of what the views see, in the visible world.
Eigen::Vector3d middle(const std::vector<ScenePatch>& patches) {
  Eigen::Vector3d result;
  std::vector<double> values(patches.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < patches.size(); ++i) values[i] = patches[i].point[axis];
    result[axis] = median_in(values);
  }
  return result;
}

/// What the views see of the visible world, as large as register_clouds measures a cloud: nine of
/// ten patches lie within the diameter.
struct SeenScene {
  Eigen::Vector3d middle;
  double diameter = 0;
};

SeenScene seen_scene(const std::vector<ScenePatch>& patches) {
  SeenScene scene{middle(patches)};
  std::vector<double> radii;
  for (const ScenePatch& patch : patches) radii.push_back((patch.point - scene.middle).norm());
  scene.diameter = 2 * quantile(radii, 0.9);
  return scene;
}

/// The visible world turned and grown about a point.
Similarity3d about(const Eigen::Vector3d& center, double turn_deg, const Eigen::Vector3d& axis,
                   double growth) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_deg * std::numbers::pi / 180, axis));
  return {growth, turn, center - growth * (turn * center)};
}

std::vector<ImageCandidate> starts_round(const Similarity3d& visible_from_thermal,
                                         const Eigen::Vector3d& center,
                                         const SimilaritySearchOptions& options) {
  std::vector<ImageCandidate> starts;
  for (const double sign : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis)
      starts.push_back({about(center, sign * options.turn_deg, Eigen::Vector3d::Unit(axis), 1) *
                        visible_from_thermal});
    starts.push_back(
        {about(center, 0, Eigen::Vector3d::UnitX(), std::pow(1 + options.growth, sign)) *
         visible_from_thermal});
  }
  return starts;
}

/// How far the images turned and grew the clouds' answer, in steps of the search.
double steps_between(const Similarity3d& a, const Similarity3d& b,
                     const SimilaritySearchOptions& options) {
  return std::max(rotation_angle_deg(a.rotation, b.rotation) / options.turn_deg,
                  std::abs(std::log(a.scale / b.scale)) / std::log1p(options.growth));
}

/// How far they shifted the scene's middle, as a share of its diameter.
double shift_between(const Similarity3d& a, const Similarity3d& b, const SeenScene& scene) {
  const Eigen::Vector3d shifted = (a * b.inverse()) * scene.middle;
  return (shifted - scene.middle).norm() / scene.diameter;
}

}  // namespace

Status SimilaritySearchOptions::validate() const {
  const OptionCheck check("similarity_search");
  ORBITFUSE_TRY(check("turn_deg", turn_deg, above_up_to(0, 45)));
  ORBITFUSE_TRY(check("growth", growth, above_up_to(0, 1)));
  ORBITFUSE_TRY(check("decisive_share", decisive_share, from_to(0, 1)));
  ORBITFUSE_TRY(check("most_views", most_views, at_least(1)));
  return check("finalists", finalists, at_least(1));
}

Result<SimilarityRefinement> search_similarity(const SceneRenderer& visible,
                                               const std::vector<cv::Mat>& images,
                                               const std::vector<PosedView>& thermal,
                                               const Similarity3d& visible_from_thermal,
                                               const SimilaritySearchOptions& options,
                                               const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  const auto finish = [&](const Similarity3d& start, const std::vector<RenderRound>& rounds) {
    return refine_similarity(visible, images, thermal, visible_from_thermal, start, rounds,
                             progress);
  };
  if (images.size() != thermal.size() || thermal.empty())
    return finish(visible_from_thermal, similarity_rounds());

  Evidence seen{visible, {}, {}, progress};
  const std::size_t count = std::min(static_cast<std::size_t>(options.most_views), thermal.size());
  for (std::size_t k = 0; k < count; ++k) {
    seen.images.push_back(images[k * thermal.size() / count]);
    seen.thermal.push_back(thermal[k * thermal.size() / count]);
  }
  ImageCandidate first{visible_from_thermal};
  ORBITFUSE_TRY(open(seen, first));
  if (!(first.support > 0)) return finish(visible_from_thermal, similarity_rounds());
  const SeenScene scene = seen_scene(first.patches);
  std::vector<ImageCandidate> candidates =
      starts_round(visible_from_thermal, scene.middle, options);
  ORBITFUSE_TRY(close(seen, first));
  // Growing by a step moves by that share of the scene's size too.
  const double moved = std::max(
      steps_between(first.visible_from_thermal, visible_from_thermal, options),
      shift_between(first.visible_from_thermal, visible_from_thermal, scene) / options.growth);
  progress.report(
      {.stage = "register",
       .detail = fmt::format("from the clouds' answer: support {:.0f}, {:.2f} of the patches in "
                             "place, moved by {:.2f} steps",
                             first.support, first.share, moved)});
  const std::vector<RenderRound> last_rounds{
      {.width_px = 160, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 12},
      {.width_px = 256, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 12},
      {.width_px = 320, .search_px = 6, .patch_search_px = 7, .patch_radius_px = 12}};
  if (options.clouds_decide && first.share >= options.decisive_share && moved < 0.5) {
    ORBITFUSE_ASSIGN(SimilarityRefinement result, finish(first.visible_from_thermal, last_rounds));
    result.skips.push_back(
        {"further starts of the refinement by the thermal images",
         fmt::format("images and clouds agree: {:.0f} % of the patches in place, {:.1f} of a "
                     "start's step from the clouds' answer",
                     100 * first.share, moved),
         fmt::format("{} starts not tried", candidates.size())});
    return result;
  }
  for (ImageCandidate& candidate : candidates) {
    ORBITFUSE_TRY(open(seen, candidate));
    progress.report(
        {.stage = "register", .detail = fmt::format("start: support {:.0f}", candidate.support)});
  }
  const int starts = 1 + static_cast<int>(candidates.size());
  // Clutter can draw a start to where the clouds don't meet at all.
  const auto lost = [&](const ImageCandidate& candidate) {
    const Similarity3d& there = candidate.visible_from_thermal;
    return steps_between(there, visible_from_thermal, options) > farthest ||
           shift_between(there, visible_from_thermal, scene) > farthest_shift;
  };
  const auto better = [](const ImageCandidate& a, const ImageCandidate& b) {
    return a.support > b.support;
  };
  std::erase_if(candidates, lost);
  std::stable_sort(candidates.begin(), candidates.end(), better);
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(options.finalists)));
  for (ImageCandidate& candidate : candidates) {
    ORBITFUSE_TRY(close(seen, candidate));
    progress.report({.stage = "register",
                     .detail = fmt::format("finalist: support {:.0f}, {:.2f} in place",
                                           candidate.support, candidate.share)});
  }
  candidates.push_back(std::move(first));
  std::erase_if(candidates, lost);
  if (candidates.empty()) candidates.push_back({visible_from_thermal});
  const ImageCandidate& best = *std::min_element(candidates.begin(), candidates.end(), better);
  ORBITFUSE_ASSIGN(SimilarityRefinement result, finish(best.visible_from_thermal, last_rounds));
  result.starts = starts;
  return result;
}

}  // namespace orbitfuse
