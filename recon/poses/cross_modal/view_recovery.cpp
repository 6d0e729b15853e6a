// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/view_recovery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/image/undistorted.hpp"
#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/whole_view.hpp"
#include "recon/poses/cross_modal/added_views.hpp"
#include "recon/poses/cross_modal/places_beside.hpp"
#include "recon/poses/cross_modal/temperature_consistency.hpp"
#include "recon/poses/cross_modal/thermal_bundle.hpp"

namespace orbitfuse {
namespace {

/// Views with less than this share of the median support are tried at other elevations.
constexpr double nudged_below_share = 0.85, nudge_deg = 2;
/// Views with less than this share are searched as wholes.
constexpr double lost_share = 0.6;
/// Through a lens that is off by this share nobody judges views.
constexpr double other_lens_share = 0.05;

/// From a degree or two off, the first without new renders of the field.
std::vector<RenderRound> approach_rounds() {
  return {{.width_px = 200, .search_px = 10, .patch_search_px = 8, .patch_radius_px = 12},
          {.width_px = 256, .search_px = 6, .patch_search_px = 7, .patch_radius_px = 10}};
}

/// Of the first `count` views, at least one.
double median_support(const Fit& alignment, std::size_t count) {
  std::vector<double> supports;
  for (std::size_t i = 0; i < count; ++i) supports.push_back(alignment.views[i].support());
  return median(supports);
}

/// Takes what is supported better; returns those views.
std::vector<std::size_t> keep_better(const std::vector<std::size_t>& owner, const Fit& tried,
                                     Fit& alignment) {
  std::vector<std::size_t> better;
  for (std::size_t c = 0; c < owner.size(); ++c) {
    RenderAlignedView& view = alignment.views[owner[c]];
    if (tried.views[c].support() <= clearly_better * view.support()) continue;
    view = tried.views[c];
    better.push_back(owner[c]);
  }
  return better;
}

/// Views that don't come back to their place from where their loop predicts them, or have little
/// support there, so that they may have come back to a wrong one.
Result<std::vector<std::size_t>> unsettled(const OrbitRefinement& refinement, Fit& alignment) {
  const LoopModel model = loop_model(refinement.orbit, alignment);
  std::vector<std::size_t> all(alignment.views.size()), lost;
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<PosedView> starts, places;
  for (const std::size_t i : all)
    starts.push_back(predicted(refinement.orbit, alignment, model, i));
  ORBITFUSE_ASSIGN(
      const Fit tried,
      refinement.restart(
          all, starts,
          {{.width_px = 160, .search_px = 12, .patch_search_px = 10, .patch_radius_px = 16},
           {.width_px = 256, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 12}}));
  const double typical = median_support(alignment, all.size());
  for (const std::size_t i : all) {
    const RenderAlignedView& view = alignment.views[i];
    if (same_place(refinement.orbit, view.view.cam_from_world,
                   tried.views[i].view.cam_from_world) &&
        view.support() > lost_share * typical)
      continue;
    lost.push_back(i);
    places.push_back(tried.views[i].view);
  }
  // Compared after the same last round.
  ORBITFUSE_ASSIGN(const Fit judged, refinement.restart(lost, places, {judging_rounds().back()}));
  keep_better(lost, judged, alignment);
  // A restart that found good support is no longer lost.
  std::erase_if(lost, [&](std::size_t i) {
    return alignment.views[i].support() > nudged_below_share * typical;
  });
  return lost;
}

/// Lost views searched as wholes from where their loop predicts them; what is better is kept.
Status search_whole(const OrbitRefinement& refinement, const std::vector<std::size_t>& lost,
                    std::vector<RenderRound> rounds, Fit& alignment) {
  ORBITFUSE_ASSIGN(const std::vector<PosedView> starts, refinement.search(lost, alignment));
  ORBITFUSE_ASSIGN(const Fit tried, refinement.restart(lost, starts, std::move(rounds)));
  keep_better(lost, tried, alignment);
  return {};
}

/// Low views of a scene can settle a little too high or too low: the weaker ones are tried there,
/// again as long as that helps. Whether it helped any.
Result<bool> nudge(const OrbitRefinement& refinement, std::size_t first, Fit& alignment) {
  const double typical = median_support(alignment, alignment.views.size());
  bool helped = false;
  for (const double elevation_deg : {nudge_deg, -nudge_deg}) {
    std::vector<std::size_t> weak;
    for (std::size_t i = first; i < alignment.views.size(); ++i)
      if (alignment.views[i].support() < nudged_below_share * typical) weak.push_back(i);
    for (int pass = 0; pass < 2 && !weak.empty(); ++pass) {
      std::vector<PosedView> starts;
      for (const std::size_t i : weak) {
        starts.push_back(alignment.views[i].view);
        starts.back().cam_from_world =
            moved(starts.back().cam_from_world, refinement.orbit.canonical_from_world,
                  {0, elevation_deg, 0});
      }
      ORBITFUSE_ASSIGN(const Fit tried, refinement.restart(weak, starts, fine_rounds()));
      weak = keep_better(weak, tried, alignment);
      helped |= !weak.empty();
    }
  }
  return helped;
}

/// Views that temperatures alone know and that form has pulled away again go back, with the support
/// that form has for them there.
Status keep_by_temperatures(const OrbitRefinement& refinement, const TemperatureCheck& check,
                            Fit& alignment) {
  std::vector<std::size_t> pulled;
  std::vector<PosedView> places;
  for (const auto& [i, cam_from_world] : check.by_temperatures_alone) {
    if (same_place(refinement.orbit, alignment.views[i].view.cam_from_world, cam_from_world))
      continue;
    pulled.push_back(i);
    places.push_back(alignment.views[i].view);
    places.back().cam_from_world = cam_from_world;
  }
  ORBITFUSE_ASSIGN(const Fit there, refinement.restart(pulled, places, {judging_rounds().back()}));
  for (std::size_t c = 0; c < pulled.size(); ++c) {
    ViewVerdict verdict = std::move(alignment.views[pulled[c]].verdict);
    alignment.views[pulled[c]] = there.views[c];
    alignment.views[pulled[c]].view = places[c];
    alignment.views[pulled[c]].verdict = std::move(verdict);
  }
  return {};
}

/// The images, as a lens without the k1 that was found would have taken them.
void straighten(OrbitViews& orbit, const Fit& alignment) {
  const Camera& camera = alignment.views.front().view.camera;
  for (std::size_t i = 0; i < orbit.images.size(); ++i)
    orbit.images[i] = straightened(orbit.images[i], camera, alignment.radial);
}

/// The support that form has where the bundle has put the views. One that it has moved elsewhere,
/// to where form knows much less of it, is not sure.
Status judge_bundled(const OrbitRefinement& refinement, const std::vector<std::size_t>& bundled,
                     const Fit& before, Fit& alignment) {
  const TraceSpan span("judge bundle");
  std::vector<PosedView> places;
  for (const std::size_t i : bundled) places.push_back(alignment.views[i].view);
  // The round that `before` was measured by: support grows with resolution.
  ORBITFUSE_ASSIGN(const Fit there, refinement.restart(bundled, places, {fine_rounds().back()}));
  for (std::size_t c = 0; c < bundled.size(); ++c) {
    const std::size_t i = bundled[c];
    RenderAlignedView& view = alignment.views[i];
    const RenderAlignedView &form_alone = before.views[i], &here = there.views[c];
    const bool moved =
        !same_place(refinement.orbit, form_alone.view.cam_from_world, view.view.cam_from_world);
    // Within one place, edges beside the temperatures' say no less for it.
    if (!moved && here.support() < form_alone.support()) continue;
    view.agreement = here.agreement, view.matches = here.matches, view.median_px = here.median_px;
    const bool held =
        same_place(refinement.orbit, here.view.cam_from_world, view.view.cam_from_world) &&
        here.support() >= lost_share * form_alone.support();
    if (!moved || !view.verdict.sure() || held) continue;
    view.verdict = {
        Confidence::doubtful, DoubtReason::neighbours_elsewhere,
        fmt::format(
            "its neighbours' temperatures place it {:.1f} deg away, where the visible "
            "scene doesn't hold it ({:.2f} of the support it had)",
            apart_deg(refinement.orbit, form_alone.view.cam_from_world, view.view.cam_from_world),
            share_of_median(here.support(), form_alone.support()))};
  }
  return {};
}

/// What temperatures said of the views through a lens that has turned out to be another, or could
/// not say because they contradicted most, they are asked again; what they move is bundled again.
/// The images are straight by now. What form said of places that the bundle moved views to stands
/// where they still are. Returns how many the temperatures contradict.
Result<int> judge_anew(const OrbitRefinement& refinement, const FocalGuess& prior, Fit& alignment) {
  const TraceSpan span("judge anew");
  refinement.progress.report({"poses.thermal", 3, 4, -1, "views judged anew, by the lens found"});
  const Fit judged = alignment;
  for (RenderAlignedView& view : alignment.views) view.verdict = {};
  const double found_focal_px = alignment.views.front().view.camera.fx;
  const double radial = std::exchange(alignment.radial, 0),
               radial_px = std::exchange(alignment.radial_px, 0);
  ORBITFUSE_ASSIGN(const TemperatureCheck check, correct_by_temperatures(refinement, alignment));
  // The bundle has left those out that were dropped before it.
  const std::vector<std::size_t> bundled = not_dropped(judged), kept = not_dropped(alignment);
  const bool came_back = !std::includes(bundled.begin(), bundled.end(), kept.begin(), kept.end());
  if (check.moved > 0 || came_back) {
    const Fit before = alignment;
    ORBITFUSE_TRY(
        bundle_thermal(refinement, {prior.focal_px, prior.relative_sigma, 0}, {}, alignment));
    ORBITFUSE_TRY(judge_bundled(refinement, not_dropped(alignment), before, alignment));
    ORBITFUSE_TRY(keep_by_temperatures(refinement, check, alignment));
  }
  for (std::size_t i = 0; i < alignment.views.size(); ++i)
    if (judged.views[i].verdict.reason == DoubtReason::neighbours_elsewhere &&
        alignment.views[i].verdict.sure() &&
        same_place(refinement.orbit, judged.views[i].view.cam_from_world,
                   alignment.views[i].view.cam_from_world))
      alignment.views[i].verdict = judged.views[i].verdict;
  const double scale = alignment.views.front().view.camera.fx / found_focal_px;
  alignment.radial = radial * scale * scale;
  alignment.radial_px = radial_px;
  return check.contradicted;
}

}  // namespace

Status refine_orbit(const SceneRenderer& renderer, OrbitViews& orbit, RenderAlignment& alignment,
                    const LensSigmas& lens, const Progress& progress) {
  if (alignment.views.empty()) return {};
  constexpr double least_focal_sigma = 1e-4;
  const FocalGuess prior{alignment.views.front().view.camera.fx,
                         std::max(least_focal_sigma, lens.focal_relative), lens.radial};
  const OrbitRefinement refinement{renderer, orbit, progress};
  ORBITFUSE_TRY(refinement.together(alignment, prior, approach_rounds()));
  ORBITFUSE_ASSIGN(const std::vector<std::size_t> lost, unsettled(refinement, alignment));
  progress.report({"poses.thermal",
                   3,
                   4,
                   {},
                   fmt::format("{} views don't come back to their place", lost.size())});
  ORBITFUSE_TRY(search_whole(refinement, lost, judging_rounds(), alignment));
  ORBITFUSE_TRY(refinement.together(alignment, prior, fine_rounds()));
  ORBITFUSE_ASSIGN(const bool nudged, nudge(refinement, 0, alignment));
  if (nudged) ORBITFUSE_TRY(refinement.together(alignment, prior, {fine_rounds().back()}));
  ORBITFUSE_ASSIGN(const TemperatureCheck check, correct_by_temperatures(refinement, alignment));
  if (check.moved > 0) {
    ORBITFUSE_TRY(refinement.together(alignment, prior, {fine_rounds().back()}));
    ORBITFUSE_TRY(keep_by_temperatures(refinement, check, alignment));
  }
  const Fit before = alignment;
  ORBITFUSE_TRY(bundle_thermal(refinement, prior, {}, alignment));
  straighten(orbit, alignment);
  std::vector<std::size_t> all(alignment.views.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  ORBITFUSE_TRY(judge_bundled(refinement, all, before, alignment));
  const double focal_moved = std::abs(
      std::log(alignment.views.front().view.camera.fx / before.views.front().view.camera.fx));
  int contradicted = check.contradicted;
  if (check.undecided > 0 || focal_moved > other_lens_share) {
    ORBITFUSE_ASSIGN(contradicted, judge_anew(refinement, prior, alignment));
  }
  ORBITFUSE_TRY(try_places_beside(refinement, alignment));
  doubt_unconfirmed(contradicted, alignment);
  return {};
}

double station_offset_deg(const OrbitViews& orbit, const RenderAlignment& alignment) {
  return loop_model(orbit, alignment).offset_deg;
}

Status add_views(const SceneRenderer& renderer, const OrbitViews& orbit, std::size_t first_new,
                 RenderAlignment& alignment, const Progress& progress) {
  const OrbitRefinement refinement{renderer, orbit, progress};
  const LoopModel model = loop_model(orbit, alignment);
  if (first_new == 0) return {};
  const double typical = median_support(alignment, first_new);
  std::vector<std::size_t> added, lost;
  std::vector<PosedView> starts;
  for (std::size_t i = first_new; i < orbit.images.size(); ++i) {
    added.push_back(i);
    starts.push_back(predicted(orbit, alignment, model, i));
  }
  std::vector<RenderRound> rounds = wide_rounds();
  for (const RenderRound& round : fine_rounds()) rounds.push_back(round);
  ORBITFUSE_ASSIGN(const Fit tried, refinement.restart(added, starts, rounds));
  for (std::size_t c = 0; c < added.size(); ++c) {
    alignment.views[added[c]] = tried.views[c];
    if (tried.views[c].support() < lost_share * typical) lost.push_back(added[c]);
  }
  progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{} of {} added views searched as a whole", lost.size(), added.size())});
  ORBITFUSE_TRY(search_whole(refinement, lost, fine_rounds(), alignment));
  ORBITFUSE_TRY(nudge(refinement, first_new, alignment));
  ORBITFUSE_TRY(confirm_by_temperatures(refinement, first_new, alignment));
  const Fit before = alignment;
  ORBITFUSE_TRY(settle_by_patches(refinement, first_new, alignment));
  return judge_bundled(refinement, added, before, alignment);
}

}  // namespace orbitfuse
