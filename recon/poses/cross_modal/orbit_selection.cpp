// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"

namespace orbitfuse {
namespace {

/// A start and its first correction; what is in place after it is the support.
std::vector<RenderRound> opening_rounds() {
  return {{.width_px = 160,
           .search_px = 30,
           .patch_search_px = 14,
           .patch_radius_px = 22,
           .patch_spacing_px = 12},
          {.width_px = 160,
           .search_px = 12,
           .patch_search_px = 10,
           .patch_radius_px = 16,
           .patch_spacing_px = 12}};
}
/// Places of one view are compared after one more.
constexpr RenderRound comparing_round{.width_px = 160,
                                      .search_px = 6,
                                      .patch_search_px = 7,
                                      .patch_radius_px = 10,
                                      .patch_spacing_px = 8};

/// Of a view; the others have been seen to be worse.
constexpr std::size_t compared_starts = 2;

/// Hypotheses with less of the best one's support are not looked at again.
constexpr double rival_share = 0.8;

/// Views that tell hypotheses apart; with twice as many every second one is asked.
constexpr std::size_t least_opened = 8;

/// A start of one view.
struct Start {
  std::size_t view = 0;
  OrbitPose pose;
};

class Selection {
 public:
  Selection(const OrbitRefinement& refinement, const std::vector<PosedView>& blank)
      : refinement_(refinement), blank_(blank) {}

  /// Each of the starts taken through the rounds.
  Result<RenderAlignment> aligned(const std::vector<Start>& starts,
                                  std::vector<RenderRound> rounds) const {
    std::vector<std::size_t> chosen;
    std::vector<PosedView> views;
    const Similarity3d world_from_canonical = refinement_.orbit.canonical_from_world.inverse();
    for (const Start& start : starts) {
      chosen.push_back(start.view);
      views.push_back(blank_[start.view]);
      views.back().cam_from_world =
          rebase(cam_from_world_of(start.pose, views.back().camera), world_from_canonical);
    }
    return refinement_.restart(chosen, views, std::move(rounds));
  }

  /// Once more from where they are.
  Result<RenderAlignment> compared(const std::vector<std::size_t>& views,
                                   const std::vector<PosedView>& places) const {
    return refinement_.restart(views, places, {comparing_round});
  }

  std::size_t views() const { return blank_.size(); }

 private:
  const OrbitRefinement& refinement_;
  const std::vector<PosedView>& blank_;
};

std::vector<Start> best_of_search(const OrbitHypothesis& hypothesis, std::size_t every) {
  std::vector<Start> starts;
  for (std::size_t i = 0; i < hypothesis.poses.size(); i += every)
    starts.push_back({i, hypothesis.poses[i]});
  return starts;
}

/// Beyond the search's best place: its second, and where the loop has the view.
std::vector<Start> further_starts(const OrbitHypothesis& hypothesis) {
  std::vector<Start> starts;
  for (std::size_t i = 0; i < hypothesis.poses.size(); ++i) {
    if (hypothesis.starts[i].size() > 1) starts.push_back({i, hypothesis.starts[i][1]});
    for (const double azimuth_deg : {-7.0, 0.0, 7.0}) {
      starts.push_back({i, hypothesis.nominal[i]});
      starts.back().pose.azimuth_deg += azimuth_deg;
    }
  }
  return starts;
}

/// Indices of a view's best supported starts, best first.
std::vector<std::vector<std::size_t>> ranked(const std::vector<Start>& starts,
                                             const RenderAlignment& tried, std::size_t views) {
  std::vector<std::vector<std::size_t>> of_view(views);
  for (std::size_t s = 0; s < starts.size(); ++s) of_view[starts[s].view].push_back(s);
  for (std::vector<std::size_t>& list : of_view)
    std::stable_sort(list.begin(), list.end(), [&](std::size_t a, std::size_t b) {
      return tried.views[a].support() > tried.views[b].support();
    });
  return of_view;
}

/// Every view at the best supported of all starts tried; the best few of each are compared.
Result<RenderAlignment> best_starts(const Selection& selection, const OrbitHypothesis& hypothesis) {
  std::vector<Start> starts = best_of_search(hypothesis, 1);
  for (const Start& start : further_starts(hypothesis)) starts.push_back(start);
  ORBITFUSE_ASSIGN(const RenderAlignment tried, selection.aligned(starts, opening_rounds()));
  std::vector<std::size_t> owner;
  std::vector<PosedView> places;
  for (const std::vector<std::size_t>& list : ranked(starts, tried, selection.views()))
    for (std::size_t k = 0; k < std::min(list.size(), compared_starts); ++k) {
      owner.push_back(starts[list[k]].view);
      places.push_back(tried.views[list[k]].view);
    }
  ORBITFUSE_ASSIGN(const RenderAlignment compared, selection.compared(owner, places));
  RenderAlignment best;
  best.views.resize(selection.views());
  best.focal_px = compared.focal_px;
  std::vector<bool> seen(selection.views(), false);
  for (std::size_t c = 0; c < owner.size(); ++c) {
    RenderAlignedView& view = best.views[owner[c]];
    if (seen[owner[c]] && compared.views[c].support() <= view.support()) continue;
    view = compared.views[c];
    seen[owner[c]] = true;
  }
  return best;
}

/// Whether two hypotheses' views ended at the same places, mostly.
bool same_orbit(const OrbitViews& orbit, const RenderAlignment& a, const RenderAlignment& b) {
  constexpr double same_deg = 2;
  std::vector<double> apart;
  for (std::size_t i = 0; i < a.views.size(); ++i)
    apart.push_back(
        apart_deg(orbit, a.views[i].view.cam_from_world, b.views[i].view.cam_from_world));
  return median(apart) < same_deg;
}

/// Whether another start or direction: another distance is the same walk, seen less well.
bool is_rival(const OrbitHypothesis& a, const OrbitHypothesis& b) {
  constexpr double other_start_deg = 40;
  return a.mirrored != b.mirrored ||
         std::abs(std::remainder(a.offset_deg - b.offset_deg, 360)) >= other_start_deg;
}

}  // namespace

double mean_support(const RenderAlignment& alignment) {
  double sum = 0;
  for (const RenderAlignedView& view : alignment.views) sum += view.support();
  return sum / static_cast<double>(std::max<std::size_t>(alignment.views.size(), 1));
}

std::vector<double> supports_of(const RenderAlignment& alignment) {
  std::vector<double> supports;
  for (const RenderAlignedView& view : alignment.views) supports.push_back(view.support());
  return supports;
}

double lead_standard_errors(const RenderAlignment& better, const RenderAlignment& other) {
  return lead_standard_errors(supports_of(better), supports_of(other));
}

double lead_standard_errors(const std::vector<double>& better, const std::vector<double>& other) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < better.size(); ++i) {
    const double d = better[i] - other[i];
    sum += d, squares += d * d;
  }
  const auto n = static_cast<double>(better.size());
  const double variance = std::max(squares / n - (sum / n) * (sum / n), 1e-12);
  return (sum / n) / std::sqrt(variance / n);
}

Result<RenderAlignment> open_orbit(const OrbitRefinement& refinement,
                                   const std::vector<PosedView>& blank,
                                   const OrbitHypothesis& hypothesis) {
  const std::size_t every = blank.size() >= 2 * least_opened ? 2 : 1;
  return Selection(refinement, blank).aligned(best_of_search(hypothesis, every), opening_rounds());
}

Result<SelectedOrbit> select_by_renders(const SceneRenderer& renderer, OrbitViews& orbit,
                                        const std::vector<PosedView>& blank,
                                        const std::vector<OrbitHypothesis>& hypotheses,
                                        const Progress& progress) {
  const TraceSpan span("hypotheses by renders");
  const OrbitRefinement refinement{renderer, orbit, progress};
  const Selection selection(refinement, blank);
  SelectedOrbit selected;
  std::vector<RenderAlignment> openings;
  for (const OrbitHypothesis& hypothesis : hypotheses) {
    ORBITFUSE_ASSIGN(RenderAlignment opened, open_orbit(refinement, blank, hypothesis));
    const double support = mean_support(opened);
    selected.supports.push_back(
        {hypothesis.offset_deg, hypothesis.radius, hypothesis.mirrored, support, false});
    // Of two that end at the same places the better supported one goes on.
    for (std::size_t before = 0; before < openings.size(); ++before) {
      HypothesisSupport& other = selected.supports[before];
      if (other.repeats || !same_orbit(orbit, openings[before], opened)) continue;
      (other.support < support ? other : selected.supports.back()).repeats = true;
    }
    openings.push_back(std::move(opened));
    progress.report({"poses.thermal",
                     2,
                     4,
                     {},
                     fmt::format("start at {:.0f} deg{}, distance {:.2f}: support {:.1f}",
                                 hypothesis.offset_deg, hypothesis.mirrored ? " clockwise" : "",
                                 hypothesis.radius, support)});
  }
  double best_opening = 0;
  for (const HypothesisSupport& one : selected.supports)
    if (!one.repeats) best_opening = std::max(best_opening, one.support);
  double best = 0;
  std::vector<std::pair<std::size_t, RenderAlignment>> finished;
  for (std::size_t h = 0; h < hypotheses.size(); ++h) {
    if (selected.supports[h].repeats || selected.supports[h].support < rival_share * best_opening)
      continue;
    ORBITFUSE_ASSIGN(RenderAlignment one, best_starts(selection, hypotheses[h]));
    selected.supports[h].support = mean_support(one);
    finished.emplace_back(h, one);
    if (selected.supports[h].support <= best) continue;
    best = selected.supports[h].support;
    selected.hypothesis = h;
    selected.alignment = std::move(one);
  }
  if (!(best > 0))
    return fail(ErrorKind::quality, "poses.thermal",
                fmt::format("nothing of any of {} views is in place in renders of the visible "
                            "scene, wherever the orbit is started",
                            blank.size()),
                "thermal views of the same object, or known poses");
  for (const auto& [h, alignment] : finished)
    if (is_rival(hypotheses[h], hypotheses[selected.hypothesis]))
      selected.lead_standard_errors =
          std::min(selected.lead_standard_errors.value_or(std::numeric_limits<double>::infinity()),
                   lead_standard_errors(selected.alignment, alignment));
  double rival = 0;
  for (std::size_t h = 0; h < hypotheses.size(); ++h)
    if (is_rival(hypotheses[h], hypotheses[selected.hypothesis]))
      rival = std::max(rival, mean_support(openings[h]));
  selected.opening = std::move(openings[selected.hypothesis]);
  selected.opening_lead = mean_support(selected.opening) / rival;
  orbit.clockwise = hypotheses[selected.hypothesis].mirrored;
  orbit.stations = hypotheses[selected.hypothesis].stations;
  return selected;
}

}  // namespace orbitfuse
