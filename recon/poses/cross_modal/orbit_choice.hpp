// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/cross_modal/orbit_evidence.hpp"
#include "recon/poses/cross_modal/orbit_selection.hpp"

namespace orbitfuse {

/// Where an orbit was begun, and how its camera was held.
struct OrbitChoice {
  OrbitEvidence evidence;
  std::vector<OrbitHypothesis> hypotheses = {};
  OrbitViews orbit = {};
  std::vector<PosedView> blank = {};
  SelectedOrbit selected = {};

  /// Of the best start over a rival; infinite without one.
  double lead() const;
  /// Mean of the views', as far as a turn doesn't change it: images on their side are compared at
  /// another angular resolution.
  double support() const;
  /// Of the same views, turned otherwise.
  bool clearly_better_than(const OrbitChoice& other) const;
};

/// The evidence's best hypothesis by renders. Errors: quality (nothing of any view is in place),
/// the renderer's, cancelled.
Result<OrbitChoice> choose_orbit(const SceneRenderer& renderer, const OrbitEvidence& evidence,
                                 const Progress& progress);

/// The same of the images turned upside down or on either side, whichever supports more.
Result<OrbitChoice> choose_turned_orbit(const SceneRenderer& renderer,
                                        const OrbitEvidence& evidence, const Progress& progress);

}  // namespace orbitfuse
