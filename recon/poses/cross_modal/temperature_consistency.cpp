// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/temperature_consistency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/whole_view.hpp"
#include "recon/poses/cross_modal/painted_scene.hpp"

namespace orbitfuse {
namespace {

/// Where temperatures contradicted this share, patches have to confirm the median view, or nobody
/// knows any. Rows of the perturbed suite that are right had up to 0.5 of the views contradicted
/// and 33 patches or more; `statue` with rolled cameras, 11 % off, 0.4 and 19.
constexpr double much_contradicted = 0.3;
constexpr double least_confirming_patches = 30;

/// Of the views' median correlation with what the others paint at their places; a view with less is
/// searched again. A wrong view of `sedan` had .56 of .96, right ones .84 and more unless a wrong
/// neighbour painted.
constexpr double asked_correlation_share = 0.75;
/// Two views turned by less are one station's: its own temperatures confirm any place.
constexpr double own_turn_deg = 8;

/// Whether the place found among the temperatures of settled views confirms the view's.
ViewVerdict in_settled_scene(const OrbitViews& orbit, const RenderAlignedView& view,
                             const RenderAlignedView& second, double median_supports) {
  if (!(share_of_median(second.support(), median_supports) > found_support_share))
    return {Confidence::dropped, DoubtReason::not_found,
            "its edges are not found among the stations' temperatures"};
  const Rigid3d &by_form = view.view.cam_from_world, &by_temperatures = second.view.cam_from_world;
  if (same_place(orbit, by_form, by_temperatures)) return {};
  return {Confidence::dropped, DoubtReason::temperatures_elsewhere,
          fmt::format("the visible scene and the stations' temperatures place it {:.1f} deg apart",
                      apart_deg(orbit, by_form, by_temperatures))};
}

using SupportOfLoop =
    std::map<int, double>;  // support by loop: one sees more of the scene than another

SupportOfLoop median_supports(const OrbitViews& orbit, const std::vector<std::size_t>& asked,
                              const Fit& found) {
  std::map<int, std::vector<double>> supports;
  for (std::size_t c = 0; c < asked.size(); ++c)
    supports[orbit.stations[asked[c]].loop].push_back(found.views[c].support());
  std::vector<double> of_all;
  for (const auto& [loop, values] : supports)
    of_all.insert(of_all.end(), values.begin(), values.end());
  // A loop of one or two views would be measured against themselves.
  constexpr std::size_t least_of_loop = 3;
  SupportOfLoop median_of_loop;
  for (const auto& [loop, values] : supports)
    median_of_loop[loop] = median(values.size() < least_of_loop ? of_all : values);
  return median_of_loop;
}

/// Views whose place isn't confirmed by the temperatures of the settled ones. Each is given the
/// place that both agree on from there, if there is one. `median_of_loop` is filled where empty.
Result<std::vector<std::size_t>> unconfirmed(const OrbitRefinement& visible,
                                             const OrbitRefinement& painted,
                                             const std::vector<std::size_t>& asked,
                                             SupportOfLoop& median_of_loop, Fit& alignment) {
  const OrbitViews& orbit = visible.orbit;
  std::vector<PosedView> starts, places;
  for (const std::size_t i : asked) starts.push_back(alignment.views[i].view);
  ORBITFUSE_ASSIGN(const Fit second, painted.restart(asked, starts, judging_rounds()));
  if (median_of_loop.empty()) median_of_loop = median_supports(orbit, asked, second);
  const auto verdict_of = [&](std::size_t view, const RenderAlignedView& by_form,
                              const RenderAlignedView& by_temperatures) {
    return in_settled_scene(orbit, by_form, by_temperatures,
                            median_of_loop.at(orbit.stations[view].loop));
  };
  std::vector<std::size_t> doubtful, still;
  std::vector<RenderAlignedView> seconds;
  for (std::size_t c = 0; c < asked.size(); ++c) {
    RenderAlignedView& view = alignment.views[asked[c]];
    view.verdict = verdict_of(asked[c], view, second.views[c]);
    if (view.verdict.sure()) continue;
    doubtful.push_back(asked[c]);
    seconds.push_back(second.views[c]);
    places.push_back(second.views[c].view);
  }
  ORBITFUSE_ASSIGN(const Fit first, visible.restart(doubtful, places, fine_rounds()));
  for (std::size_t c = 0; c < doubtful.size(); ++c) {
    if (verdict_of(doubtful[c], first.views[c], seconds[c]).sure())
      alignment.views[doubtful[c]] = first.views[c];
    else
      still.push_back(doubtful[c]);
  }
  return still;
}

/// The scene that the chosen views paint, for views that are turned by `min_turn_deg` or more.
Result<SceneRenderer> painted_by(const OrbitRefinement& refinement, const Fit& alignment,
                                 const std::vector<std::size_t>& chosen, double min_turn_deg) {
  PaintedSceneOptions painting;
  painting.min_turn_deg = min_turn_deg;
  std::vector<PosedView> painters;
  std::vector<cv::Mat> images;
  for (const std::size_t i : chosen) {
    painters.push_back(alignment.views[i].view);
    images.push_back(refinement.orbit.images[i]);
  }
  return painted_scene(refinement.renderer, painters, images, painting, refinement.progress);
}

struct Contradicted {
  std::vector<std::size_t> views;  ///< whose place the temperatures of the others don't confirm
  SupportOfLoop median_of_loop;    ///< support of a view in the scene that all others paint
  double median_correlation = 0;   ///< of an image with what all others paint there
};

Result<Contradicted> contradicted(const OrbitRefinement& refinement, const Fit& alignment) {
  const OrbitViews& orbit = refinement.orbit;
  std::vector<std::size_t> all(alignment.views.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<PosedView> places = alignment.poses();
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   painted_by(refinement, alignment, all, own_turn_deg));
  const OrbitRefinement painted{renderer, orbit, refinement.progress};
  ORBITFUSE_ASSIGN(const Fit second, painted.restart(all, places, judging_rounds()));
  Contradicted lost{{}, median_supports(orbit, all, second), 0};
  std::vector<std::optional<double>> correlations;
  std::vector<double> known;
  for (const std::size_t i : all) {
    ORBITFUSE_ASSIGN(const std::optional<double> correlation,
                     correlation_with(renderer, orbit.images[i], places[i]));
    correlations.push_back(correlation);
    if (correlation) known.push_back(*correlation);
  }
  lost.median_correlation = median(known);
  const double asked_below = known.empty() ? -1 : asked_correlation_share * lost.median_correlation;
  for (const std::size_t i : all)
    if (second.views[i].support() <
            settled_support_share * lost.median_of_loop.at(orbit.stations[i].loop) ||
        !same_place(orbit, places[i].cam_from_world, second.views[i].view.cam_from_world) ||
        correlations[i].value_or(1) < asked_below)
      lost.views.push_back(i);
  return lost;
}

/// The loop predicts a view as well as its station was kept: the best supported of places round
/// the prediction, at low resolution.
Result<std::vector<PosedView>> best_beside(const OrbitRefinement& painted,
                                           const std::vector<std::size_t>& lost,
                                           const Fit& alignment) {
  constexpr double azimuth_deg = 7, elevation_deg = 4;
  const LoopModel model = loop_model(painted.orbit, alignment);
  std::vector<std::size_t> owner;
  std::vector<PosedView> starts;
  for (std::size_t c = 0; c < lost.size(); ++c)
    for (const double a : {-azimuth_deg, 0.0, azimuth_deg})
      for (const double e : {-elevation_deg, 0.0, elevation_deg}) {
        owner.push_back(lost[c]);
        starts.push_back(predicted(painted.orbit, alignment, model, lost[c]));
        starts.back().cam_from_world =
            moved(starts.back().cam_from_world, painted.orbit.canonical_from_world, {a, e, 0});
      }
  ORBITFUSE_ASSIGN(const Fit tried, painted.restart(owner, starts, wide_rounds()));
  const std::size_t each = lost.empty() ? 0 : tried.views.size() / lost.size();
  std::vector<PosedView> best;
  for (std::size_t c = 0; c < lost.size(); ++c) {
    const auto first = tried.views.begin() + static_cast<std::ptrdiff_t>(c * each);
    best.push_back(std::max_element(first, first + static_cast<std::ptrdiff_t>(each),
                                    [](const RenderAlignedView& x, const RenderAlignedView& y) {
                                      return x.support() < y.support();
                                    })
                       ->view);
  }
  return best;
}

/// A view that neither scene places goes to the one of the two places where its image is most like
/// what the others paint. Whether it moved.
Result<bool> leave_unplaced(const OrbitRefinement& refinement, const SceneRenderer& painted,
                            const cv::Mat& image, bool agree, const PosedView& by_temperatures,
                            double median_correlation, RenderAlignedView& view) {
  ORBITFUSE_ASSIGN(const auto here, correlation_with(painted, image, view.view));
  ORBITFUSE_ASSIGN(const auto there, correlation_with(painted, image, by_temperatures));
  const double like_here = share_of_median(here.value_or(0), median_correlation),
               like_there = share_of_median(there.value_or(0), median_correlation);
  const double apart =
      apart_deg(refinement.orbit, view.view.cam_from_world, by_temperatures.cam_from_world);
  refinement.progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{}: placed by nobody; its image is {:.2f} as much like the others' as usual "
                   "where it was, {:.2f} where temperatures have it",
                   view.view.name, like_here, like_there)});
  view.verdict = verdict_of_unplaced(agree, apart, std::max(like_here, like_there));
  const bool like_enough = view.verdict.on_probation || like_there >= like_correlation_share;
  const bool moves =
      view.verdict.confidence == Confidence::doubtful && like_enough && like_there > like_here;
  if (moves) {
    view.view = by_temperatures;
    view.agreement = 0, view.matches = 0;  // form's were of the place it left
  }
  return moves;
}

}  // namespace

Result<SceneRenderer> painted_by_others(const OrbitRefinement& refinement, const Fit& alignment,
                                        const std::vector<std::size_t>& chosen) {
  return painted_by(refinement, alignment, chosen, own_turn_deg);
}

Result<Fit> best_by_temperatures(const OrbitRefinement& painted,
                                 const std::vector<std::size_t>& lost, const Fit& alignment) {
  std::vector<PosedView> places;
  for (const std::size_t i : lost) places.push_back(alignment.views[i].view);
  ORBITFUSE_ASSIGN(const std::vector<PosedView> starts, painted.search(lost, alignment));
  ORBITFUSE_ASSIGN(Fit best, painted.restart(lost, places, judging_rounds()));
  ORBITFUSE_ASSIGN(const Fit searched, painted.restart(lost, starts, judging_rounds()));
  const auto keep_better = [&](const Fit& tried) {
    for (std::size_t c = 0; c < lost.size(); ++c)
      if (tried.views[c].support() > clearly_better * best.views[c].support())
        best.views[c] = tried.views[c];
  };
  keep_better(searched);
  ORBITFUSE_ASSIGN(const std::vector<PosedView> beside, best_beside(painted, lost, alignment));
  ORBITFUSE_ASSIGN(const Fit tried, painted.restart(lost, beside, judging_rounds()));
  keep_better(tried);
  return best;
}

Result<TemperatureCheck> correct_by_temperatures(const OrbitRefinement& refinement,
                                                 Fit& alignment) {
  const TraceSpan span("correct by temperatures");
  const OrbitViews& orbit = refinement.orbit;
  ORBITFUSE_ASSIGN(const Contradicted found, contradicted(refinement, alignment));
  const std::vector<std::size_t>& lost = found.views;
  refinement.progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{} views contradicted by the others' temperatures", lost.size())});
  TemperatureCheck check;
  check.contradicted = static_cast<int>(lost.size());
  if (2 * lost.size() > alignment.views.size()) check.undecided = static_cast<int>(lost.size());
  if (check.undecided > 0)
    for (const std::size_t i : lost)
      alignment.views[i].verdict = {
          Confidence::doubtful, DoubtReason::undecided,
          fmt::format("the others' temperatures contradict it and {} more of {} views: nobody is "
                      "left to judge",
                      lost.size() - 1, alignment.views.size())};
  if (lost.empty() || check.undecided > 0) return check;
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i < alignment.views.size(); ++i)
    if (std::count(lost.begin(), lost.end(), i) == 0) rest.push_back(i);
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   painted_by(refinement, alignment, rest, own_turn_deg));
  ORBITFUSE_ASSIGN(const Fit by_temperatures,
                   best_by_temperatures({renderer, orbit, refinement.progress}, lost, alignment));
  ORBITFUSE_ASSIGN(const Fit by_form,
                   refinement.restart(lost, by_temperatures.poses(), fine_rounds()));
  std::vector<std::size_t> all(alignment.views.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const SupportOfLoop median_form = median_supports(orbit, all, alignment);
  for (std::size_t c = 0; c < lost.size(); ++c) {
    const RenderAlignedView &form = by_form.views[c], &warm = by_temperatures.views[c];
    RenderAlignedView& view = alignment.views[lost[c]];
    const int loop = orbit.stations[lost[c]].loop;
    PlaceEvidence seen;
    seen.agree = same_place(orbit, form.view.cam_from_world, warm.view.cam_from_world);
    seen.form_before = share_of_median(view.support(), median_form.at(loop));
    seen.form_there = share_of_median(form.support(), median_form.at(loop));
    seen.temperatures_there = share_of_median(warm.support(), found.median_of_loop.at(loop));
    seen.stays = same_place(orbit, view.view.cam_from_world, warm.view.cam_from_world);
    refinement.progress.report(
        {"poses.thermal", 3, 4, -1,
         fmt::format("{}: share of the median support {:.2f} among temperatures, {:.2f} of form "
                     "there, {:.2f} "
                     "before, {:.1f} deg away; {}",
                     view.view.name, seen.temperatures_there, seen.form_there, seen.form_before,
                     apart_deg(orbit, view.view.cam_from_world, warm.view.cam_from_world),
                     seen.agree ? "they agree" : "they differ")});
    const MoveDecision decision = who_places(seen);
    if (decision == MoveDecision::nobody) {
      ORBITFUSE_ASSIGN(const bool moved,
                       leave_unplaced(refinement, renderer, orbit.images[lost[c]], seen.agree,
                                      warm.view, found.median_correlation, view));
      if (moved) check.by_temperatures_alone.emplace_back(lost[c], view.view.cam_from_world);
      continue;
    }
    const PosedView& place = decision == MoveDecision::both                 ? form.view
                             : decision == MoveDecision::temperatures_alone ? warm.view
                                                                            : view.view;
    const double moved_deg = apart_deg(orbit, view.view.cam_from_world, place.cam_from_world);
    if (ViewVerdict verdict =
            verdict_of_move(decision, seen, moved_deg,
                            !same_place(orbit, view.view.cam_from_world, place.cam_from_world));
        !verdict.sure())
      view.verdict = std::move(verdict);
    if (decision == MoveDecision::temperatures_alone)
      check.by_temperatures_alone.emplace_back(lost[c], place.cam_from_world);
    check.moved += decision == MoveDecision::form_alone ? 0 : 1;
    view.view = place;
  }
  return check;
}

void doubt_unconfirmed(int contradicted, Fit& alignment) {
  const std::vector<std::size_t> kept = not_dropped(alignment);
  if (kept.empty() ||
      contradicted < much_contradicted * static_cast<double>(alignment.views.size()))
    return;
  std::vector<double> patches;
  for (const std::size_t i : kept)
    patches.push_back(alignment.views[i].confirmed_patches.value_or(0));
  const double typical = median(patches);
  if (typical >= least_confirming_patches) return;
  for (const std::size_t i : kept)
    if (ViewVerdict& verdict = alignment.views[i].verdict; verdict.sure())
      verdict = {
          Confidence::doubtful, DoubtReason::undecided,
          fmt::format("the others' temperatures contradicted {} of {} views, and few patches "
                      "are found again in several ({:.0f} in the median view)",
                      contradicted, alignment.views.size(), typical)};
}

Status confirm_by_temperatures(const OrbitRefinement& refinement, std::size_t first_new,
                               Fit& alignment) {
  const OrbitViews& orbit = refinement.orbit;
  std::vector<std::size_t> settled, added;
  for (std::size_t i = 0; i < first_new; ++i)
    if (alignment.views[i].verdict.sure()) settled.push_back(i);
  for (std::size_t i = first_new; i < orbit.images.size(); ++i) added.push_back(i);
  if (settled.size() < least_painters) {
    for (const std::size_t i : added)
      alignment.views[i].verdict = {
          Confidence::doubtful, DoubtReason::undecided,
          fmt::format("{} of {} stations are sure: too few temperatures to confirm it by",
                      settled.size(), first_new)};
    return {};
  }
  ORBITFUSE_ASSIGN(const SceneRenderer renderer, painted_by(refinement, alignment, settled, 0));
  const OrbitRefinement painted{renderer, orbit, refinement.progress};
  SupportOfLoop median_of_loop;
  ORBITFUSE_ASSIGN(std::vector<std::size_t> lost,
                   unconfirmed(refinement, painted, added, median_of_loop, alignment));
  ORBITFUSE_ASSIGN(const std::vector<PosedView> starts, painted.search(lost, alignment));
  ORBITFUSE_ASSIGN(const Fit searched, refinement.restart(lost, starts, fine_rounds()));
  for (std::size_t c = 0; c < lost.size(); ++c) alignment.views[lost[c]] = searched.views[c];
  ORBITFUSE_ASSIGN(lost, unconfirmed(refinement, painted, lost, median_of_loop, alignment));
  refinement.progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{} of {} added views are not confirmed", lost.size(), added.size())});
  return {};
}

}  // namespace orbitfuse
