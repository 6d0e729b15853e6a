// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/heat_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "core/numeric/median.hpp"
#include "recon/poses/cross_modal/painted_scene.hpp"

namespace orbitfuse {
namespace {

/// Of their loop's usual support among temperatures. Right places on `container` had 0.7 or more,
/// wrong ones 0.4 at most.
constexpr double found_share = 0.5;
/// Among stations, which see less of each other's scene: below it a station is searched again.
constexpr double settled_share = 0.6;
/// Of their loop's usual support in the visible scene: views that form alone may vouch for.
constexpr double vouched_share = 0.6;
/// Two views turned by less are one station's: its own temperatures confirm any place.
constexpr double own_turn_deg = 8;
/// Rounding of no support at all.
constexpr double least_support = 1e-9;

/// Why the place found among the temperatures of settled views doesn't confirm the view's; empty if
/// it does.
std::string doubt(const OrbitViews& orbit, const RenderAlignedView& view,
                  const RenderAlignedView& second, double usual_support) {
  if (!(share_of_usual(second.support(), usual_support) > found_share))
    return "its edges are not found among the stations' temperatures";
  const Rigid3d &by_form = view.view.cam_from_world, &by_heat = second.view.cam_from_world;
  if (same_place(orbit, by_form, by_heat)) return {};
  return fmt::format("the visible scene and the stations' temperatures place it {:.1f} deg apart",
                     apart_deg(orbit, by_form, by_heat));
}

using Usual = std::map<int, double>;  // support by loop: one sees more of the scene than another

Usual usual_support(const OrbitViews& orbit, const std::vector<std::size_t>& asked,
                    const Fit& found) {
  std::map<int, std::vector<double>> supports;
  for (std::size_t c = 0; c < asked.size(); ++c)
    supports[orbit.stations[asked[c]].loop].push_back(found.views[c].support());
  Usual usual;
  for (const auto& [loop, values] : supports) usual[loop] = median(values);
  return usual;
}

/// Views whose place isn't confirmed by the temperatures of the settled ones. Each is given the
/// place that both agree on from there, if there is one. `usual` is filled where empty.
Result<std::vector<std::size_t>> unconfirmed(const Refinery& visible, const Refinery& painted,
                                             const std::vector<std::size_t>& asked, Usual& usual,
                                             Fit& alignment) {
  const OrbitViews& orbit = visible.orbit;
  std::vector<PosedView> starts, places;
  for (const std::size_t i : asked) starts.push_back(alignment.views[i].view);
  ORBITFUSE_ASSIGN(const Fit second, painted.restart(asked, starts, judging_rounds()));
  if (usual.empty()) usual = usual_support(orbit, asked, second);
  const auto doubt_of = [&](std::size_t view, const RenderAlignedView& by_form,
                            const RenderAlignedView& by_heat) {
    return doubt(orbit, by_form, by_heat, usual.at(orbit.stations[view].loop));
  };
  std::vector<std::size_t> doubtful, still;
  std::vector<RenderAlignedView> seconds;
  for (std::size_t c = 0; c < asked.size(); ++c) {
    RenderAlignedView& view = alignment.views[asked[c]];
    view.doubt = doubt_of(asked[c], view, second.views[c]);
    if (view.doubt.empty()) continue;
    doubtful.push_back(asked[c]);
    seconds.push_back(second.views[c]);
    places.push_back(second.views[c].view);
  }
  ORBITFUSE_ASSIGN(const Fit first, visible.restart(doubtful, places, fine_rounds()));
  for (std::size_t c = 0; c < doubtful.size(); ++c) {
    if (doubt_of(doubtful[c], first.views[c], seconds[c]).empty())
      alignment.views[doubtful[c]] = first.views[c];
    else
      still.push_back(doubtful[c]);
  }
  return still;
}

/// The scene that the chosen views paint, for views that are turned by `min_turn_deg` or more.
Result<SceneRenderer> painted_by(const Refinery& refinery, const Fit& alignment,
                                 const std::vector<std::size_t>& chosen, double min_turn_deg) {
  PaintedSceneOptions painting;
  painting.min_turn_deg = min_turn_deg;
  std::vector<PosedView> painters;
  std::vector<cv::Mat> images;
  for (const std::size_t i : chosen) {
    painters.push_back(alignment.views[i].view);
    images.push_back(refinery.orbit.images[i]);
  }
  return painted_scene(refinery.renderer, painters, images, painting, refinery.progress);
}

struct Contradicted {
  std::vector<std::size_t> views;  ///< whose place the temperatures of the others don't confirm
  Usual usual;                     ///< support of a view in the scene that all others paint
};

Result<Contradicted> contradicted(const Refinery& refinery, const Fit& alignment) {
  const OrbitViews& orbit = refinery.orbit;
  std::vector<std::size_t> all(alignment.views.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<PosedView> places = alignment.poses();
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   painted_by(refinery, alignment, all, own_turn_deg));
  const Refinery painted{renderer, orbit, refinery.progress};
  ORBITFUSE_ASSIGN(const Fit second, painted.restart(all, places, judging_rounds()));
  Contradicted lost{{}, usual_support(orbit, all, second)};
  for (const std::size_t i : all)
    if (second.views[i].support() < settled_share * lost.usual.at(orbit.stations[i].loop) ||
        !same_place(orbit, places[i].cam_from_world, second.views[i].view.cam_from_world))
      lost.views.push_back(i);
  return lost;
}

/// Where temperatures place each view best: from where it is, or searched as a whole.
Result<Fit> best_by_heat(const Refinery& painted, const std::vector<std::size_t>& lost,
                         const Fit& alignment) {
  std::vector<PosedView> places;
  for (const std::size_t i : lost) places.push_back(alignment.views[i].view);
  ORBITFUSE_ASSIGN(const std::vector<PosedView> starts, painted.search(lost, alignment));
  ORBITFUSE_ASSIGN(Fit best, painted.restart(lost, places, judging_rounds()));
  ORBITFUSE_ASSIGN(const Fit searched, painted.restart(lost, starts, judging_rounds()));
  for (std::size_t c = 0; c < lost.size(); ++c)
    if (searched.views[c].support() > clearly_better * best.views[c].support())
      best.views[c] = searched.views[c];
  return best;
}

}  // namespace

HeatVerdict verdict(const HeatOpinions& seen) {
  const bool found = seen.heat_there > settled_share;
  // Two scenes that show nothing of the view agree as easily as two that do: one must know it there.
  const bool better_by_form =
      seen.form_there > vouched_share && seen.form_there >= seen.form_before;
  if (seen.agree && (found || better_by_form)) return HeatVerdict::both;
  // Temperatures know more edges: where they are sure, form alone doesn't pull a view away.
  if (!seen.agree && found) return HeatVerdict::heat_alone;
  // Where they find it nowhere they don't speak against a place that form knows well.
  if (seen.heat_there < found_share && seen.form_before > vouched_share &&
      seen.form_before > seen.form_there)
    return HeatVerdict::form_alone;
  return HeatVerdict::doubt;
}

double share_of_usual(double support, double usual) {
  return usual > least_support ? support / usual : 0;
}

Result<HeatCheck> correct_by_heat(const Refinery& refinery, Fit& alignment) {
  const OrbitViews& orbit = refinery.orbit;
  ORBITFUSE_ASSIGN(const Contradicted found, contradicted(refinery, alignment));
  const std::vector<std::size_t>& lost = found.views;
  refinery.progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{} views contradicted by the others' temperatures", lost.size())});
  HeatCheck check;
  if (2 * lost.size() > alignment.views.size()) check.undecided = static_cast<int>(lost.size());
  if (lost.empty() || check.undecided > 0) return check;
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i < alignment.views.size(); ++i)
    if (std::count(lost.begin(), lost.end(), i) == 0) rest.push_back(i);
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   painted_by(refinery, alignment, rest, own_turn_deg));
  ORBITFUSE_ASSIGN(const Fit by_heat,
                   best_by_heat({renderer, orbit, refinery.progress}, lost, alignment));
  ORBITFUSE_ASSIGN(const Fit by_form, refinery.restart(lost, by_heat.poses(), fine_rounds()));
  std::vector<std::size_t> all(alignment.views.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const Usual usual_form = usual_support(orbit, all, alignment);
  for (std::size_t c = 0; c < lost.size(); ++c) {
    const RenderAlignedView &form = by_form.views[c], &heat = by_heat.views[c];
    RenderAlignedView& view = alignment.views[lost[c]];
    const int loop = orbit.stations[lost[c]].loop;
    HeatOpinions seen;
    seen.agree = same_place(orbit, form.view.cam_from_world, heat.view.cam_from_world);
    seen.form_before = share_of_usual(view.support(), usual_form.at(loop));
    seen.form_there = share_of_usual(form.support(), usual_form.at(loop));
    seen.heat_there = share_of_usual(heat.support(), found.usual.at(loop));
    refinery.progress.report(
        {"poses.thermal", 3, 4, -1,
         fmt::format("{}: usual support {:.2f} among temperatures, {:.2f} of form there, {:.2f} "
                     "before, {:.1f} deg away; {}",
                     view.view.name, seen.heat_there, seen.form_there, seen.form_before,
                     apart_deg(orbit, view.view.cam_from_world, heat.view.cam_from_world),
                     seen.agree ? "they agree" : "they differ")});
    switch (verdict(seen)) {
      case HeatVerdict::both:
        view.view = form.view;
        ++check.moved;
        break;
      case HeatVerdict::heat_alone:
        check.by_heat_alone.emplace_back(lost[c], heat.view.cam_from_world);
        view.view = heat.view;
        ++check.moved;
        break;
      case HeatVerdict::form_alone:
        view.objection = fmt::format(
            "the other views' temperatures contradict its place and find it nowhere (at best {:.2f} "
            "of the usual support); the visible scene alone keeps it, at {:.2f} of its usual support",
            seen.heat_there, seen.form_before);
        break;
      case HeatVerdict::doubt:
        view.doubt = fmt::format(
            "the visible scene and the other views' temperatures place it {:.1f} deg apart",
            apart_deg(orbit, view.view.cam_from_world, heat.view.cam_from_world));
    }
  }
  return check;
}

Status confirm_by_heat(const Refinery& refinery, std::size_t first_new, Fit& alignment) {
  const OrbitViews& orbit = refinery.orbit;
  std::vector<std::size_t> settled, added;
  for (std::size_t i = 0; i < first_new; ++i)
    if (alignment.views[i].doubt.empty()) settled.push_back(i);
  for (std::size_t i = first_new; i < orbit.images.size(); ++i) added.push_back(i);
  ORBITFUSE_ASSIGN(const SceneRenderer renderer, painted_by(refinery, alignment, settled, 0));
  const Refinery painted{renderer, orbit, refinery.progress};
  Usual usual;
  ORBITFUSE_ASSIGN(std::vector<std::size_t> lost,
                   unconfirmed(refinery, painted, added, usual, alignment));
  ORBITFUSE_ASSIGN(const std::vector<PosedView> starts, painted.search(lost, alignment));
  ORBITFUSE_ASSIGN(const Fit searched, refinery.restart(lost, starts, fine_rounds()));
  for (std::size_t c = 0; c < lost.size(); ++c) alignment.views[lost[c]] = searched.views[c];
  ORBITFUSE_ASSIGN(lost, unconfirmed(refinery, painted, lost, usual, alignment));
  refinery.progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{} of {} added views are not confirmed", lost.size(), added.size())});
  return {};
}

}  // namespace orbitfuse
