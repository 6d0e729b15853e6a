// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/thermal_bundle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/geometry/narrowed.hpp"
#include "core/image/undistorted.hpp"
#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/pose_bundle.hpp"

namespace orbitfuse {
namespace {

/// A view with fewer patches found again is held by edges alone.
constexpr int least_patches = 12;
/// A sighting within this of where the bundle has it confirms the view's pose.
constexpr double confirmed_px = 1;
/// A lens that bends by less than this share of what counts, as the wide rounds see it, is
/// straight.
constexpr double straight_share = 0.5;

/// Who takes part in a bundle: views that are adjusted, and those in which their patches are looked
/// for.
struct BundleRoles {
  std::vector<std::size_t> adjusted, lenders;
  bool hold_others = false;  ///< else edges of the visible scene hold them
};

/// What one solve is made of, at the options' width.
struct BundleRound {
  ThermalViews views;
  std::vector<bool> held;  ///< views that stay where they are
  std::vector<ThermalTrack> tracks;
  std::vector<std::vector<PatchMatch>> edges;  ///< of each view, in the visible scene
};

struct BundleSolution {
  std::vector<PoseCorrection> corrections;
  double log_focal = 0;
  double radial = 0;           ///< k1 that straightened images still had
  double radial_reach_px = 0;  ///< by how much a k1 of 1 shifts the outer tenth of the patches
  double median_px = 0;        ///< of the sightings' residuals
  std::vector<int> confirmed;  ///< patches of each view
};

PoseBundle bundle_of(const BundleRound& round, const ThermalBundleOptions& options) {
  const ThermalViews& views = round.views;
  PoseBundle bundle(views.camera, views.images.size());
  for (std::size_t v = 0; v < round.held.size(); ++v)
    if (round.held[v]) bundle.hold(v);
  for (const ThermalTrack& track : round.tracks) {
    SharedPlace place{track.sight, options.surface_sigma * track.distance, {}};
    for (const ThermalSighting& seen : track.sightings) {
      const Rigid3d& pose = views.cam_from_world[seen.view];
      place.sightings.push_back({seen.view, pose * track.surface, pose.rotation.toRotationMatrix(),
                                 seen.pixel, seen.sqrt_weight});
    }
    bundle.add(std::move(place));
  }
  for (std::size_t v = 0; v < round.edges.size(); ++v)
    for (const PatchMatch& match : round.edges[v])
      bundle.add(v, match, options.edge_weight * match.score);
  return bundle;
}

/// By how much a k1 of 1 shifts the outer tenth of the patches.
double radial_reach_px(const BundleRound& round) {
  std::vector<double> radii;
  for (const ThermalTrack& track : round.tracks)
    radii.push_back(round.views.camera.normalized_of(track.sightings.front().pixel).norm());
  constexpr double most = 0.9;
  return std::pow(quantile(radii, most), 3) * round.views.camera.fx;
}

/// A patch confirms the view that it was taken from, and each that shows it, where both have it
/// within confirmed_px: a view doesn't confirm itself.
BundleSolution summarised(const BundleRound& round, const PoseBundle& bundle) {
  BundleSolution solution{
      bundle.corrections(), bundle.log_focal(), bundle.radial(), radial_reach_px(round), 0, {}};
  solution.confirmed.assign(solution.corrections.size(), 0);
  std::vector<double> residuals;
  const auto residuals_px = bundle.sighting_residuals_px();
  for (std::size_t t = 0; t < residuals_px.size(); ++t) {
    std::vector<bool> near;
    for (const double residual : residuals_px[t]) {
      near.push_back(residual < confirmed_px);
      if (std::isfinite(residual)) residuals.push_back(residual);
    }
    if (!near.front()) continue;
    const auto& sightings = round.tracks[t].sightings;
    for (std::size_t s = 1; s < sightings.size(); ++s)
      solution.confirmed[sightings[s].view] += near[s] ? 1 : 0;
    solution.confirmed[sightings.front().view] +=
        std::count(near.begin() + 1, near.end(), true) > 0 ? 1 : 0;
  }
  solution.median_px = residuals.empty() ? 0 : median(residuals);
  return solution;
}

/// Nothing where no usable answer is found.
std::optional<BundleSolution> solved(const BundleRound& round, const CommonLensPrior& lens,
                                     const std::vector<double>& sighting_losses_px,
                                     const ThermalBundleOptions& options) {
  PoseBundle bundle = bundle_of(round, options);
  for (const double scale_px : sighting_losses_px)
    if (!bundle.solve(lens, {1, scale_px}, options.max_iterations)) return std::nullopt;
  return summarised(round, bundle);
}

Result<BundleRound> prepared(const OrbitRefinement& refinement, const Fit& alignment,
                             const BundleRoles& roles, const ThermalBundleOptions& options,
                             int reach_px) {
  BundleRound round;
  round.held.assign(alignment.views.size(), roles.hold_others);
  if (roles.hold_others)
    for (const std::size_t i : roles.adjusted) round.held[i] = false;
  ThermalViews& views = round.views;
  views.camera =
      narrowed_to(alignment.views.front().view.camera, options.width_px).without_distortion();
  std::vector<SceneRender> renders;
  for (std::size_t i = 0; i < alignment.views.size(); ++i) {
    ORBITFUSE_TRY(refinement.progress.check("poses.thermal"));
    views.cam_from_world.push_back(alignment.views[i].view.cam_from_world);
    views.images.push_back(straightened(reduced_to(refinement.orbit.images[i], views.camera),
                                        views.camera, alignment.radial));
    ORBITFUSE_ASSIGN(SceneRender render,
                     refinement.renderer(views.camera, views.cam_from_world.back()));
    views.depth.push_back(render.depth);
    renders.push_back(std::move(render));
  }
  ThermalTrackOptions tracks = options.tracks;
  tracks.reach_px = reach_px;
  round.tracks = thermal_tracks(views, roles.adjusted, roles.lenders, tracks);
  round.edges.resize(renders.size());
  const RenderRound fine = fine_rounds().back();
  parallel_for(static_cast<int>(renders.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    if (round.held[i]) return;
    round.edges[i] = match_patches(
        renders[i], rendered_edges(renders[i]), views.camera,
        orientation_field(views.images[i], 1.0),
        {fine.search_px, fine.patch_search_px, fine.patch_radius_px, fine.patch_spacing_px});
  });
  return round;
}

/// Whether most of the adjusted views have enough sightings to be placed by them.
bool placed_by_sightings(const BundleRound& round, const std::vector<std::size_t>& adjusted) {
  std::vector<int> sightings(round.views.images.size(), 0);
  for (const ThermalTrack& track : round.tracks)
    for (const ThermalSighting& seen : track.sightings) ++sightings[seen.view];
  const auto placed = std::count_if(adjusted.begin(), adjusted.end(),
                                    [&](std::size_t i) { return sightings[i] >= least_patches; });
  return 2 * static_cast<std::size_t>(placed) >= adjusted.size();
}

void take(const BundleSolution& solution, const std::vector<std::size_t>& chosen, Fit& alignment) {
  const double scale = std::exp(solution.log_focal);
  for (std::size_t i = 0; i < alignment.views.size(); ++i) {
    PosedView& view = alignment.views[i].view;
    view.cam_from_world = rigid_of(solution.corrections[i]) * view.cam_from_world;
    view.camera.fx *= scale, view.camera.fy *= scale;
  }
  for (const std::size_t i : chosen) alignment.views[i].confirmed_patches = solution.confirmed[i];
  alignment.focal_px = alignment.views.front().view.camera.fx;
  // What was straightened before was so in coordinates of the old focal length.
  alignment.radial = alignment.radial * scale * scale + solution.radial;
  alignment.radial_px = std::abs(alignment.radial) * solution.radial_reach_px;
}

/// The most that a chosen view has turned, about itself or about the object.
double most_turned_deg(const OrbitViews& orbit, const std::vector<std::size_t>& chosen,
                       const Fit& before, const Fit& after) {
  double most = 0;
  for (const std::size_t i : chosen)
    most = std::max(most, apart_deg(orbit, before.views[i].view.cam_from_world,
                                    after.views[i].view.cam_from_world));
  return most;
}

/// One round from where the views are: by how much it has turned them at most; nothing where
/// nothing could be solved.
Result<std::optional<double>> solve_round(const OrbitRefinement& refinement,
                                          const FocalGuess& prior, const BundleRoles& roles,
                                          const BundleStep& step,
                                          const ThermalBundleOptions& options, Fit& bundled) {
  ORBITFUSE_ASSIGN(const BundleRound round,
                   prepared(refinement, bundled, roles, options, step.reach_px));
  const double focal_px = bundled.views.front().view.camera.fx;
  std::optional<BundleSolution> solution;
  if (roles.hold_others || placed_by_sightings(round, roles.adjusted))
    solution = solved(round,
                      {{std::log(prior.focal_px / focal_px), prior.relative_sigma},
                       {-bundled.radial, prior.radial_sigma}},
                      step.sighting_losses_px, options);
  const auto tell = [&](const std::string& words) {
    refinement.progress.report(
        {"poses.thermal", 3, 4, -1,
         fmt::format("{} places seen by several thermal views{}", round.tracks.size(), words)});
  };
  if (!solution) {
    tell(": too few to bundle them");
    return std::nullopt;
  }
  const Fit before = bundled;
  take(*solution, roles.adjusted, bundled);
  const double turned_deg = most_turned_deg(refinement.orbit, roles.adjusted, before, bundled);
  tell(fmt::format(
      ", {:.2f} px; focal length {:+.2f} %, k1 {:+.3f}, {:.2f} px far out, views turned by up to "
      "{:.2f} deg",
      solution->median_px, 100 * (std::exp(solution->log_focal) - 1), bundled.radial,
      bundled.radial_px, turned_deg));
  return turned_deg;
}

/// A k1 below none folds the image over beyond some radius: a lens whose corners lie there is not
/// described by it.
bool reaches_corners(const Fit& bundled) {
  Camera bent = bundled.views.front().view.camera;
  bent.k1 = bundled.radial;
  for (const double x : {0.0, static_cast<double>(bent.width)})
    for (const double y : {0.0, static_cast<double>(bent.height)})
      if (!bent.normalized_of({x, y}).allFinite()) return false;
  return true;
}

/// Rounds of one kind; false where one could not be solved.
Result<bool> solve_rounds(const OrbitRefinement& refinement, const FocalGuess& prior,
                          const BundleRoles& roles, const BundleStep& step,
                          const ThermalBundleOptions& options, Fit& bundled) {
  double turned_deg = step.settled_deg;
  for (int i = 0; i < step.max_rounds && turned_deg >= step.settled_deg; ++i) {
    ORBITFUSE_ASSIGN(const std::optional<double> turned,
                     solve_round(refinement, prior, roles, step, options, bundled));
    if (!turned) return false;
    turned_deg = *turned;
  }
  return true;
}

}  // namespace

Status bundle_thermal(const OrbitRefinement& refinement, const FocalGuess& prior,
                      const ThermalBundleOptions& options, Fit& alignment) {
  const TraceSpan span("thermal bundle");
  const std::vector<std::size_t> chosen = not_dropped(alignment);
  if (chosen.empty()) return {};
  Fit bundled = alignment;
  FocalGuess lens = prior;
  const auto solve = [&](const BundleStep& step) {
    return solve_rounds(refinement, lens, {chosen, chosen, false}, step, options, bundled);
  };
  const auto bends_less = [&](double least_px) {
    return lens.radial_sigma > 0 && bundled.radial_px < least_px;
  };
  const auto straighten = [&] { bundled.radial = bundled.radial_px = lens.radial_sigma = 0; };
  ORBITFUSE_ASSIGN(const bool found, solve(options.wide));
  if (!found) return {};
  if (bends_less(straight_share * options.least_radial_px)) straighten();
  ORBITFUSE_ASSIGN(const bool refined, solve(options.fine));
  if (!refined) return {};
  if (bends_less(options.least_radial_px) || !reaches_corners(bundled)) {
    straighten();
    ORBITFUSE_ASSIGN(const bool again, solve(options.fine));
    if (!again) return {};
  }
  alignment = std::move(bundled);
  return {};
}

Status bundle_added(const OrbitRefinement& refinement, const std::vector<std::size_t>& added,
                    const std::vector<std::size_t>& settled, const ThermalBundleOptions& options,
                    Fit& alignment) {
  const TraceSpan span("bundle added views");
  if (added.empty()) return {};
  Fit bundled = alignment;
  // Images are as the settled lens took them already.
  bundled.radial = bundled.radial_px = 0;
  const FocalGuess lens{alignment.views.front().view.camera.fx, 0, 0};
  for (const BundleStep& step : {options.wide, options.fine}) {
    // Nothing but settled views joins them: each moves by itself, and stops by itself.
    BundleRoles roles{added, settled, true};
    for (int i = 0; i < step.max_rounds && !roles.adjusted.empty(); ++i) {
      const Fit before = bundled;
      ORBITFUSE_ASSIGN(const std::optional<double> turned,
                       solve_round(refinement, lens, roles, step, options, bundled));
      if (!turned) break;
      std::erase_if(roles.adjusted, [&](std::size_t v) {
        return most_turned_deg(refinement.orbit, {v}, before, bundled) < step.settled_deg;
      });
    }
  }
  for (const std::size_t v : added) alignment.views[v] = bundled.views[v];
  return {};
}

}  // namespace orbitfuse
