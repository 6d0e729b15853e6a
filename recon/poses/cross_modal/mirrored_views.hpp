// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "recon/poses/cross_modal/orbit_search.hpp"
#include "recon/poses/cross_modal/orbit_selection.hpp"

// Cameras have a setting that mirrors the image. Most objects look much alike from both sides, so
// that mirrored views find places too: of another walk, with the heat on the object's wrong side.
namespace orbitfuse {

/// What the search and the selection of an orbit had, and chose.
struct ChosenOrbit {
  const LineModel& lines;
  const std::vector<SearchView>& search;
  const OrbitViews& orbit;
  const std::vector<PosedView>& blank;
  const OrbitHypothesis& hypothesis;
  const SelectedOrbit& selected;
};

/// Support of the same views mirrored left to right, against what they have as they are.
struct MirroredSupport {
  double lead_standard_errors = 0;
  double ratio = 1;
  /// Both are equal of a scene that is its own mirror image; `container`, mirrored, leads least.
  bool told() const { return lead_standard_errors >= 2.5 && ratio >= 1.08; }
};

/// Of fewer the true start may be missed, and the spread of their supports is itself chance.
inline constexpr std::size_t least_for_mirrored = 16;

/// Nothing where a few renders already say that the views aren't mirrored, and of too few views.
/// Errors: the renderer's, cancelled.
Result<std::optional<MirroredSupport>> support_if_mirrored(const SceneRenderer& renderer,
                                                           const ChosenOrbit& chosen,
                                                           const Progress& progress);

}  // namespace orbitfuse
