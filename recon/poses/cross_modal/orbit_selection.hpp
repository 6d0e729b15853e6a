// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "recon/poses/cross_modal/orbit_refinement.hpp"
#include "recon/poses/cross_modal/orbit_search.hpp"

// The lines of the visible scene propose; renders of it decide. Lines score a near camera that lays
// a roof's edge on the horizon as well as the right one, and pull a right start away; what a render
// shows in place (support) is four times less there.
namespace orbitfuse {

/// One hypothesis as renders see it.
struct HypothesisSupport {
  double offset_deg = 0, radius = 0;
  bool mirrored = false;
  double support = 0;    ///< mean over the views
  bool repeats = false;  ///< ends where one before it does
};

struct SelectedOrbit {
  RenderAlignment alignment;                ///< to about a degree
  std::size_t hypothesis = 0;               ///< index of the chosen one
  std::vector<HypothesisSupport> supports;  ///< of each, in the search's order
  RenderAlignment opening;                  ///< of the chosen one: open_orbit()
  /// Its mean support by that of the best opening that starts elsewhere; infinite without one.
  double opening_lead = 0;
  /// How far the best one leads the next that starts elsewhere or turns the other way, taken to the
  /// same end: mean difference of the views' supports in its own standard errors. None: no rival.
  std::optional<double> lead_standard_errors;
};

/// Over the views.
double mean_support(const RenderAlignment& alignment);

std::vector<double> supports_of(const RenderAlignment& alignment);

/// Mean difference of the same views' supports, in its own standard errors.
double lead_standard_errors(const std::vector<double>& better, const std::vector<double>& other);
double lead_standard_errors(const RenderAlignment& better, const RenderAlignment& other);

/// Some of the views, enough to tell hypotheses apart, at the search's best places after two
/// rounds. Errors: the renderer's, cancelled.
Result<RenderAlignment> open_orbit(const OrbitRefinement& refinement,
                                   const std::vector<PosedView>& blank,
                                   const OrbitHypothesis& hypothesis);

/// The best supported hypothesis, with the best supported of several starts of each view: its own
/// best places in the search's table, and its loop's nominal place a little before, at and after
/// its station. `blank` names the views and carries their camera. Sets orbit.clockwise and
/// orbit.stations.
/// Errors: quality (nothing of any view is in place), the renderer's, cancelled.
Result<SelectedOrbit> select_by_renders(const SceneRenderer& renderer, OrbitViews& orbit,
                                        const std::vector<PosedView>& blank,
                                        const std::vector<OrbitHypothesis>& hypotheses,
                                        const Progress& progress);

}  // namespace orbitfuse
