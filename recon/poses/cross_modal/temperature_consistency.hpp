// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "recon/poses/cross_modal/orbit_refinement.hpp"
#include "recon/poses/cross_modal/place_evidence.hpp"

// A second opinion on thermal poses: what other thermal views measured, painted on the visible
// scene's form (painted_scene.hpp). It shows edges that the visible scene lacks, and finds a view
// that settled on the wrong rib of a repeated form. Internal to recon/poses; errors: the
// renderer's, cancelled.
namespace orbitfuse {

/// Fewer views paint nothing to judge others by.
inline constexpr std::size_t least_painters = 3;

/// The scene that the chosen views paint, for views that are turned far enough not to be one of
/// them.
Result<SceneRenderer> painted_by_others(const OrbitRefinement& refinement, const Fit& alignment,
                                        const std::vector<std::size_t>& chosen);

/// Where the painted scene places each of the views best: from where it is, from where its loop
/// predicts it, or searched as a whole.
Result<Fit> best_by_temperatures(const OrbitRefinement& painted,
                                 const std::vector<std::size_t>& lost, const Fit& alignment);

struct TemperatureCheck {
  int contradicted = 0;
  int moved = 0;
  int undecided = 0;  ///< contradicted, where that were most of the views
  /// Views that form would pull away from where temperatures have them.
  std::vector<std::pair<std::size_t, Rigid3d>> by_temperatures_alone;
};

/// Each view judged by the temperatures of the others. Those that they contradict are searched as
/// wholes in the scene that the rest paints, and go where both scenes then agree or temperatures
/// are sure. One that temperatures find nowhere stays where form knows it well, as doubtful; what
/// neither knows is dropped, or doubtful where its image is what the others measured there, or on
/// probation where it is nearly so: judge_views() settles that once the bundle has moved it. Where
/// most are contradicted nobody is left to judge: they stay, as doubtful.
Result<TemperatureCheck> correct_by_temperatures(const OrbitRefinement& refinement, Fit& alignment);

/// Where temperatures contradicted many views and few patches are found again in several, all are
/// in doubt: such views confirm each other at wrong places too.
void doubt_unconfirmed(int contradicted, Fit& alignment);

/// Every added view, from `first_new` on, confirmed by what the settled ones before it measured;
/// those that are not are searched as wholes in it, and dropped if that fails.
Status confirm_by_temperatures(const OrbitRefinement& refinement, std::size_t first_new,
                               Fit& alignment);

}  // namespace orbitfuse
