// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/added_views.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/poses/cross_modal/temperature_consistency.hpp"
#include "recon/poses/cross_modal/thermal_bundle.hpp"

namespace orbitfuse {
namespace {

/// Fewer sure views settle nobody.
constexpr std::size_t least_settled = 3;
/// Of the median added view's confirmed patches: below, it is looked for elsewhere.
constexpr double asked_share = 0.5;

/// A view that is found farther from where its form has it than this is in doubt until nearly all
/// patches settle it (judged_between): plain surfaces confirm a wrong place half as well.
constexpr double elsewhere_deg = 1;
/// What a frame must gain by moving: plain sides have 3 to 27 patches, and chance moves a few.
constexpr int least_gain = 12;
constexpr double least_gain_ratio = 1.5;

bool worth_moving(int before, int after) {
  return after >= before + least_gain && after >= least_gain_ratio * before;
}

/// Views with fewer confirmed patches than that.
std::vector<std::size_t> little_confirmed(const std::vector<std::size_t>& added,
                                          const Fit& alignment) {
  std::vector<double> confirmed;
  for (const std::size_t i : added)
    confirmed.push_back(alignment.views[i].confirmed_patches.value_or(0));
  const double least = asked_share * median(confirmed);
  std::vector<std::size_t> little;
  for (const std::size_t i : added)
    if (alignment.views[i].confirmed_patches.value_or(0) < least) little.push_back(i);
  return little;
}

}  // namespace

Status settle_by_patches(const OrbitRefinement& refinement, std::size_t first_new, Fit& alignment) {
  const TraceSpan span("settle by patches");
  std::vector<std::size_t> settled, added;
  for (std::size_t i = 0; i < alignment.views.size(); ++i) {
    if (i >= first_new) added.push_back(i);
    if (i < first_new && alignment.views[i].verdict.sure()) settled.push_back(i);
  }
  if (settled.size() < least_settled || added.empty()) return {};
  ORBITFUSE_TRY(bundle_added(refinement, added, settled, {}, alignment));
  const std::vector<std::size_t> lost = little_confirmed(added, alignment);
  if (lost.empty()) return {};
  for (const std::size_t i : added)
    if (std::count(lost.begin(), lost.end(), i) == 0 &&
        alignment.views[i].verdict.confidence != Confidence::dropped)
      settled.push_back(i);
  ORBITFUSE_ASSIGN(const SceneRenderer renderer, painted_by_others(refinement, alignment, settled));
  ORBITFUSE_ASSIGN(
      const Fit warm,
      best_by_temperatures({renderer, refinement.orbit, refinement.progress}, lost, alignment));
  Fit tried = alignment;
  for (std::size_t c = 0; c < lost.size(); ++c)
    tried.views[lost[c]].view.cam_from_world = warm.views[c].view.cam_from_world;
  ORBITFUSE_TRY(bundle_added(refinement, lost, settled, {}, tried));
  for (const std::size_t i : lost) {
    const int before = alignment.views[i].confirmed_patches.value_or(0),
              after = tried.views[i].confirmed_patches.value_or(0);
    const double moved_deg = apart_deg(refinement.orbit, alignment.views[i].view.cam_from_world,
                                       tried.views[i].view.cam_from_world);
    refinement.progress.report(
        {"poses.thermal", 3, 4, -1,
         fmt::format("{}: {} patches confirmed, {} where temperatures have it, {:.1f} deg away",
                     alignment.views[i].view.name, before, after, moved_deg)});
    if (!worth_moving(before, after)) continue;
    alignment.views[i] = tried.views[i];
    ViewVerdict& verdict = alignment.views[i].verdict;
    if (moved_deg > elsewhere_deg && verdict.sure())
      verdict = {
          Confidence::doubtful, DoubtReason::temperatures_elsewhere,
          fmt::format("the other views' temperatures have it {:.1f} deg from where its edges "
                      "do",
                      moved_deg)};
  }
  return {};
}

}  // namespace orbitfuse
