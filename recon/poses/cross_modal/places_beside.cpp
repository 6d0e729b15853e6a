// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/places_beside.hpp"

#include <fmt/format.h>

#include <optional>

#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/whole_view.hpp"
#include "recon/poses/cross_modal/painted_scene.hpp"
#include "recon/poses/cross_modal/temperature_consistency.hpp"
#include "recon/poses/cross_modal/thermal_bundle.hpp"

namespace orbitfuse {
namespace {

/// About the object: a right view is less like what the others measured from each of these, unless
/// it sees little (docs/notes/poses.md).
constexpr double step_deg = 1.5;
constexpr double steps[][2] = {{1, 0}, {-1, 0}, {0, 1},  {0, -1},
                               {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};
/// By how much more alike the image must be, of what it is short of 1: a step aside to be tried,
/// and a place to be taken.
constexpr double tried_gain = 0.1, taken_gain = 0.25;

/// Beyond, it is no place beside but another one, which is asked of all that is known elsewhere.
constexpr double farthest_deg = 2 * step_deg;

struct Beside {
  std::size_t view;
  double like;  ///< correlation at its place
  PosedView start;
};

/// The place beside a view's that is most alike, where one is clearly more so than its own.
Result<std::optional<Beside>> best_beside(const OrbitViews& orbit, const SceneRenderer& painted,
                                          std::size_t i, const PosedView& view) {
  ORBITFUSE_ASSIGN(const auto here, correlation_with(painted, orbit.images[i], view));
  std::optional<Beside> better;
  if (!here) return better;
  double best = *here + tried_gain * (1 - *here);
  for (const auto& [azimuth, elevation] : steps) {
    PosedView there = view;
    there.cam_from_world = moved(view.cam_from_world, orbit.canonical_from_world,
                                 {step_deg * azimuth, step_deg * elevation, 0});
    ORBITFUSE_ASSIGN(const auto like, correlation_with(painted, orbit.images[i], there));
    if (!like || *like <= best) continue;
    best = *like;
    better = Beside{i, *here, there};
  }
  return better;
}

Result<std::vector<Beside>> candidates(const OrbitRefinement& refinement,
                                       const SceneRenderer& painted,
                                       const std::vector<std::size_t>& kept, const Fit& alignment) {
  std::vector<Result<std::optional<Beside>>> looked(kept.size());
  parallel_for(static_cast<int>(kept.size()), [&](int index) {
    if (refinement.progress.cancelled()) return;
    const auto k = static_cast<std::size_t>(index);
    looked[k] = best_beside(refinement.orbit, painted, kept[k], alignment.views[kept[k]].view);
  });
  ORBITFUSE_TRY(refinement.progress.check("poses.thermal"));
  std::vector<Beside> found;
  for (Result<std::optional<Beside>>& one : looked) {
    if (!one) return tl::unexpected(one.error());
    if (*one) found.push_back(std::move(**one));
  }
  return found;
}

/// Each bundled from its start as if it were one view more, which its own self doesn't hold: they
/// are turned too little against each other.
Result<std::vector<RenderAlignedView>> bundled_anew(const OrbitRefinement& refinement,
                                                    const std::vector<Beside>& tried,
                                                    const std::vector<std::size_t>& settled,
                                                    const Fit& alignment) {
  OrbitViews orbit = refinement.orbit;
  Fit wider = alignment;
  std::vector<std::size_t> added;
  for (const Beside& one : tried) {
    added.push_back(wider.views.size());
    orbit.images.push_back(orbit.images[one.view]);
    orbit.stations.push_back(orbit.stations[one.view]);
    wider.views.push_back(alignment.views[one.view]);
    wider.views.back().view = one.start;
  }
  ORBITFUSE_TRY(
      bundle_added({refinement.renderer, orbit, refinement.progress}, added, settled, {}, wider));
  return std::vector<RenderAlignedView>(
      wider.views.end() - static_cast<std::ptrdiff_t>(added.size()), wider.views.end());
}

}  // namespace

Result<int> try_places_beside(const OrbitRefinement& refinement, Fit& alignment) {
  const TraceSpan span("places beside");
  const OrbitViews& orbit = refinement.orbit;
  const std::vector<std::size_t> kept = not_dropped(alignment);
  std::vector<std::size_t> painters = kept;  // one on probation is no witness against others
  std::erase_if(painters, [&](std::size_t i) { return alignment.views[i].verdict.on_probation; });
  if (painters.size() < least_painters) return 0;
  ORBITFUSE_ASSIGN(const SceneRenderer painted, painted_by_others(refinement, alignment, painters));
  ORBITFUSE_ASSIGN(const std::vector<Beside> tried,
                   candidates(refinement, painted, kept, alignment));
  if (tried.empty()) return 0;
  ORBITFUSE_ASSIGN(const std::vector<RenderAlignedView> bundled,
                   bundled_anew(refinement, tried, painters, alignment));
  std::vector<std::size_t> chosen;
  std::vector<PosedView> before, places;
  for (std::size_t c = 0; c < tried.size(); ++c) {
    chosen.push_back(tried[c].view);
    before.push_back(alignment.views[tried[c].view].view);
    places.push_back(bundled[c].view);
  }
  // Compared after the same last round.
  const std::vector<RenderRound> last = {fine_rounds().back()};
  ORBITFUSE_ASSIGN(const Fit here, refinement.restart(chosen, before, last));
  ORBITFUSE_ASSIGN(const Fit there, refinement.restart(chosen, places, last));
  int went = 0;
  for (std::size_t c = 0; c < tried.size(); ++c) {
    const Beside& one = tried[c];
    ORBITFUSE_ASSIGN(const auto like, correlation_with(painted, orbit.images[one.view], places[c]));
    const RenderAlignedView &was = here.views[c], &now = there.views[c];
    const Rigid3d &from = before[c].cam_from_world, &to = places[c].cam_from_world;
    const double far_deg = apart_deg(orbit, from, to);
    // Form must say so of that place, not of one that it comes back to.
    const bool held = same_place(orbit, now.view.cam_from_world, to);
    const bool taken = like && *like > one.like + taken_gain * (1 - one.like) && held &&
                       now.support() >= was.support() && far_deg <= farthest_deg;
    refinement.progress.report(
        {"poses.thermal", 3, 4, -1,
         fmt::format("{}: bundled anew from beside, {:.2f} deg away: its image {:.3f} like the "
                     "others' ({:.3f} before), form's support {:.1f} ({:.1f}){}",
                     places[c].name, far_deg, like.value_or(0), one.like, now.support(),
                     was.support(), taken ? ": taken" : "")});
    if (!taken) continue;
    ++went;
    RenderAlignedView& view = alignment.views[one.view];
    view.view = places[c];
    view.confirmed_patches = bundled[c].confirmed_patches;
    view.agreement = now.agreement, view.matches = now.matches, view.median_px = now.median_px;
  }
  return went;
}

}  // namespace orbitfuse
