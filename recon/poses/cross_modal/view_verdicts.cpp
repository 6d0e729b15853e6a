// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/view_verdicts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/poses/cross_modal/painted_scene.hpp"
#include "recon/poses/cross_modal/place_evidence.hpp"
#include "recon/poses/cross_modal/temperature_consistency.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Wrong views had up to 0.25 of the median support of all loops, right ones 0.4 or more.
constexpr double min_support_share = 0.3;
/// Wrong views of `sedan` correlated with the others' temperatures at .42, right ones at .94 in the
/// median, the least at .64.
constexpr double min_correlation = 0.5;
/// Weak in both ways, though in neither enough to fail alone: a wrong view of `sedan` had 0.5 of
/// the support and 0.58 of the median correlation; of 570 right views of seven scenes under four
/// perturbations none had less than either.
constexpr double weak_support_share = 0.65, weak_correlation_share = 0.75;
/// Of frames between stations: two of 72 of `sedan` were 2.5 and 3.6 % off with 0.67 and 0.50.
/// Chosen on that scene alone; it doubts nine right ones there.
constexpr double min_between_share = 0.7;
/// The stations' patches settle such a frame by themselves: two of `sedan`, 3.2 and 3.5 degrees
/// off, had 0.74 of the patches and 0.38 of the support. Chosen on that scene, `container` was left
/// out.
constexpr double settling_share = 0.9, settling_support_share = 0.5;
/// Of the median view's patches found again in other thermal views: they overrule the doubt that a
/// painted scene raised, with so many where form knows the view (weak_support_share), else with
/// nearly all: frames 3 degrees off had up to 0.89.
constexpr double confirming_share = 0.4;
constexpr double least_median_patches = 30;
/// What keeps a view on probation, in doubt: the right place of one of `car` had 0.34, places of
/// one of `sedan` 3 degrees off 0 and 0.05, the former with 0.97 of the usual correlation.
constexpr double probation_patches_share = 0.25;
/// Of a view that form knows weakly: one of `statue` with rolled cameras, 9 % off, had 0.04; of
/// 1800 right ones of the perturbed suite none so weak had less than 0.24.
constexpr double least_patches_share = 0.1;
/// Below it nobody confirms a view: form knows nothing of it.
constexpr double least_support_share = 0.1;
/// Stations are good to several degrees (sigma 2 to 3), loops to two in elevation. Where an
/// operator kept them less well, all views say so.
constexpr double max_azimuth_off_deg = 12, azimuth_sigmas = 3, most_azimuth_off_deg = 25;
constexpr double max_elevation_off_deg = 8;
/// A loop keeps its distance to 3 %, loops of one operator to 5 %.
constexpr double max_log_distance_off = 0.22;
/// The operator looks at the object: 10 px of 640 in the median where right, 133 where wrong.
constexpr double max_aim_off = 0.16;

/// Pixels from which the orbit's centre is seen to the principal point, by the image's width.
double aim_off(const OrbitViews& orbit, const PosedView& view) {
  const Eigen::Vector3d center =
      rebase(view.cam_from_world, orbit.canonical_from_world).translation;
  if (!(center.z() > 0)) return 1;
  return view.camera.fx * center.head<2>().norm() / center.z() / view.camera.width;
}

/// Median support_share of the loop's other stations (ViewEvidence::loop_support_share).
double support_of_others(const OrbitViews& orbit, std::size_t stations,
                         const std::vector<ViewEvidence>& evidence, std::size_t view) {
  constexpr std::size_t least_others = 3;
  std::vector<double> others;
  bool other_loop = false;
  for (std::size_t i = 0; i < std::min(stations, evidence.size()); ++i) {
    const bool same = orbit.stations[i].loop == orbit.stations[view].loop;
    other_loop |= !same;
    if (same && i != view) others.push_back(evidence[i].support_share);
  }
  return other_loop && others.size() >= least_others ? median(others) : 0;
}

/// By how much a station lies behind the one recorded before it, or past the next.
std::vector<double> steps_back_deg(const OrbitViews& orbit, std::size_t stations,
                                   const std::vector<double>& azimuth_deg) {
  std::vector<double> back(azimuth_deg.size(), 0);
  for (std::size_t i = 1; i < stations; ++i) {
    const double step = std::remainder(azimuth_deg[i] - azimuth_deg[i - 1], 360);
    const double behind = orbit.clockwise ? step : -step;
    for (const std::size_t v : {i - 1, i}) back[v] = std::max(back[v], behind);
  }
  return back;
}

/// From its loop's elevation, or the nearest loop's where stations were assumed; 0 where its loop's
/// is not known.
double elevation_off_deg(const OrbitViews& orbit, const LoopModel& model, std::size_t view,
                         double elevation_deg) {
  const auto own = model.elevation_deg.find(orbit.stations[view].loop);
  if (own == model.elevation_deg.end()) return 0;
  double off_deg = std::abs(elevation_deg - own->second);
  if (!orbit.assumed) return off_deg;
  for (const auto& [loop, of_loop_deg] : model.elevation_deg)
    off_deg = std::min(off_deg, std::abs(elevation_deg - of_loop_deg));
  return off_deg;
}

/// confirmed_share of the views from `first` to `end`, by their own median.
void confirm_among(const Fit& alignment, std::size_t first, std::size_t end,
                   std::vector<ViewEvidence>& evidence) {
  std::vector<double> confirmed;
  for (std::size_t i = first; i < end; ++i)
    if (const auto patches = alignment.views[i].confirmed_patches) confirmed.push_back(*patches);
  const double typical = confirmed.empty() ? 0 : median(confirmed);
  if (typical < least_median_patches) return;
  for (std::size_t i = first; i < end; ++i) {
    evidence[i].confirmed_share = alignment.views[i].confirmed_patches.value_or(0) / typical;
    evidence[i].patches_tell = true;
  }
}

double median_support(const Fit& alignment) {
  std::vector<double> supports;
  for (const RenderAlignedView& view : alignment.views) supports.push_back(view.support());
  return median(supports);
}

}  // namespace

Result<std::vector<ViewEvidence>> evidence_of(const OrbitRefinement& refinement,
                                              std::size_t stations, const Fit& alignment) {
  const OrbitViews& orbit = refinement.orbit;
  std::vector<std::size_t> all(alignment.views.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<std::size_t> painters;
  for (const std::size_t i : all)
    if (alignment.views[i].verdict.sure()) painters.push_back(i);
  ORBITFUSE_ASSIGN(const SceneRenderer painted, painted_by_others(refinement, alignment, painters));
  const LoopModel model = loop_model(orbit, alignment);
  std::vector<double> radii;
  for (const auto& [loop, radius] : model.radius) radii.push_back(radius);
  const double common = radii.empty() ? 1 : median(radii);
  const double median_of_all = median_support(alignment);
  std::vector<ViewEvidence> evidence;
  std::vector<double> azimuth_deg;
  for (const std::size_t i : all) {
    const PosedView& view = alignment.views[i].view;
    ViewEvidence seen;
    seen.support_share = share_of_median(alignment.views[i].support(), median_of_all);
    ORBITFUSE_ASSIGN(seen.correlation, correlation_with(painted, orbit.images[i], view));
    const OrbitAngles at =
        orbit_angles(camera_center(rebase(view.cam_from_world, orbit.canonical_from_world)));
    azimuth_deg.push_back(at.azimuth_deg);
    seen.azimuth_off_deg =
        std::abs(std::remainder(at.azimuth_deg - model.azimuth_deg(orbit, i), 360));
    seen.elevation_off_deg = elevation_off_deg(orbit, model, i, at.elevation_deg);
    seen.log_distance_off = std::abs(std::log(at.radius / common));
    seen.aim_off = aim_off(orbit, view);
    evidence.push_back(seen);
  }
  if (orbit.assumed) {
    const std::vector<double> back = steps_back_deg(orbit, stations, azimuth_deg);
    for (std::size_t i = 0; i < std::min(stations, evidence.size()); ++i)
      evidence[i].azimuth_off_deg = back[i];
  }
  // Stations are asked of each other, frames between them of the stations: two medians.
  confirm_among(alignment, 0, stations, evidence);
  confirm_among(alignment, stations, evidence.size(), evidence);
  std::vector<double> off_deg, correlations;
  for (std::size_t i = 0; i < evidence.size(); ++i)
    evidence[i].loop_support_share = support_of_others(orbit, stations, evidence, i);
  for (const ViewEvidence& seen : evidence) {
    off_deg.push_back(seen.azimuth_off_deg);
    if (seen.correlation) correlations.push_back(*seen.correlation);
  }
  for (ViewEvidence& seen : evidence) {
    seen.azimuth_scatter_deg = sigma_of_median * median(off_deg);
    seen.median_correlation = correlations.empty() ? 0 : median(correlations);
  }
  return evidence;
}

ViewVerdict judged(const ViewEvidence& seen, const ViewVerdict& before) {
  if (before.confidence == Confidence::dropped) return before;
  if (before.on_probation) {
    const bool found = seen.confirmed_share >= probation_patches_share &&
                       seen.correlation.value_or(0) > 0 &&
                       *seen.correlation >= like_correlation_share * seen.median_correlation;
    return found ? judged(seen, {Confidence::doubtful, before.reason, before.detail})
                 : ViewVerdict{Confidence::dropped, before.reason, before.detail};
  }
  const auto doubtful = [](DoubtReason reason, std::string detail) {
    return ViewVerdict{Confidence::doubtful, reason, std::move(detail)};
  };
  // Views of a wrong loop confirm each other: only where form knows the loop's others well.
  const bool confirmed_among_known = seen.support_share >= least_support_share &&
                                     seen.confirmed_share >= confirming_share &&
                                     seen.loop_support_share >= weak_support_share;
  if (!(seen.support_share >= min_support_share) && !confirmed_among_known)
    return doubtful(DoubtReason::weak_support,
                    fmt::format("its edges have {:.2f} of the median support of all loops",
                                seen.support_share));
  if (!(seen.aim_off <= max_aim_off))
    return doubtful(
        DoubtReason::off_its_loop,
        fmt::format("it looks {:.0f} % of its width past the orbit's centre", 100 * seen.aim_off));
  const double azimuth_limit_deg = std::clamp(azimuth_sigmas * seen.azimuth_scatter_deg,
                                              max_azimuth_off_deg, most_azimuth_off_deg);
  if (!(seen.azimuth_off_deg <= azimuth_limit_deg &&
        seen.elevation_off_deg <= max_elevation_off_deg))
    return doubtful(DoubtReason::off_its_loop,
                    fmt::format("it lies {:.1f} deg of azimuth and {:.1f} deg of elevation off its "
                                "station's place on its loop",
                                seen.azimuth_off_deg, seen.elevation_off_deg));
  if (!(seen.log_distance_off <= max_log_distance_off))
    return doubtful(DoubtReason::off_its_loop,
                    fmt::format("its distance is {:.0f} % off that of the loops in common",
                                100 * seen.log_distance_off));
  if (!seen.correlation && before.sure())
    return doubtful(DoubtReason::undecided,
                    "no other sure view measured enough of what it shows to confirm it");
  if (seen.correlation && !(*seen.correlation >= min_correlation))
    return doubtful(DoubtReason::temperatures_unlike,
                    fmt::format("its image correlates with what the other views measured there at "
                                "{:.2f} only",
                                *seen.correlation));
  if (seen.correlation && seen.support_share < weak_support_share &&
      *seen.correlation < weak_correlation_share * seen.median_correlation)
    return doubtful(DoubtReason::weak_support,
                    fmt::format("its edges have {:.2f} of the median support of all loops, and its "
                                "image correlates with what the other views measured there at "
                                "{:.2f}, the median view at {:.2f}",
                                seen.support_share, *seen.correlation, seen.median_correlation));
  if (seen.patches_tell && seen.support_share < weak_support_share &&
      seen.confirmed_share < least_patches_share)
    return doubtful(DoubtReason::weak_support,
                    fmt::format("its edges have {:.2f} of the median support of all loops, and "
                                "{:.2f} of the median view's patches are found in others",
                                seen.support_share, seen.confirmed_share));
  const bool by_painting = before.reason == DoubtReason::not_found ||
                           before.reason == DoubtReason::temperatures_elsewhere ||
                           before.reason == DoubtReason::temperatures_contradict;
  const double enough =
      seen.support_share >= weak_support_share ? confirming_share : settling_share;
  if (by_painting && seen.confirmed_share >= enough) return {};
  return before;
}

ViewVerdict judged_between(const ViewEvidence& seen, const ViewVerdict& before) {
  const bool confirmed = seen.confirmed_share >= confirming_share;
  ViewVerdict verdict = judged(seen, confirmed ? ViewVerdict{} : before);
  const bool by_patches =
      seen.confirmed_share >= settling_share && seen.support_share >= settling_support_share;
  const bool by_form = before.sure() && seen.support_share >= min_between_share;
  if (!verdict.sure() || by_patches || by_form) return verdict;
  return {Confidence::doubtful, DoubtReason::weak_support,
          fmt::format("its edges have {:.2f} of the median support of all loops, {:.2f} of the "
                      "median frame's patches confirm it, and no station of its own says where it "
                      "is",
                      seen.support_share, seen.confirmed_share)};
}

std::vector<int> doubt_whole_loops(const OrbitViews& orbit, std::size_t stations, Fit& alignment) {
  std::map<int, std::pair<int, int>> loops;  // loop -> views not sure, views
  for (std::size_t i = 0; i < stations; ++i) {
    auto& [doubted, count] = loops[orbit.stations[i].loop];
    doubted += alignment.views[i].verdict.sure() ? 0 : 1;
    ++count;
  }
  std::vector<int> in_doubt;
  for (const auto& [loop, counts] : loops)
    if (2 * counts.first > counts.second) in_doubt.push_back(loop);
  for (std::size_t i = 0; i < alignment.views.size(); ++i) {
    ViewVerdict& verdict = alignment.views[i].verdict;
    const int loop = orbit.stations[i].loop;
    if (!verdict.sure() || std::count(in_doubt.begin(), in_doubt.end(), loop) == 0) continue;
    const auto& [doubted, count] = loops.at(loop);
    verdict = {Confidence::doubtful, DoubtReason::loop_in_doubt,
               fmt::format("{} of the {} views of its loop are in doubt", doubted, count)};
  }
  return in_doubt;
}

Result<std::vector<int>> judge_views(const OrbitRefinement& refinement, std::size_t stations,
                                     Fit& alignment) {
  const TraceSpan span("judge views");
  ORBITFUSE_ASSIGN(const std::vector<ViewEvidence> evidence,
                   evidence_of(refinement, stations, alignment));
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    const ViewEvidence& seen = evidence[i];
    RenderAlignedView& view = alignment.views[i];
    view.verdict = i < stations ? judged(seen, view.verdict) : judged_between(seen, view.verdict);
    refinement.progress.report(
        {"poses.thermal", 3, 4, -1,
         fmt::format("evidence {}: support {:.2f}, temperatures {:.2f}, azimuth {:.1f}, elevation "
                     "{:.1f} deg, distance {:.3f}, aim {:.3f}, {} patches confirmed",
                     view.view.name, seen.support_share, seen.correlation.value_or(-1),
                     seen.azimuth_off_deg, seen.elevation_off_deg, seen.log_distance_off,
                     seen.aim_off, view.confirmed_patches.value_or(0))});
  }
  return doubt_whole_loops(refinement.orbit, stations, alignment);
}

}  // namespace orbitfuse
