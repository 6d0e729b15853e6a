// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/cross_modal/orbit_refinement.hpp"
#include "recon/poses/cross_modal/thermal_tracks.hpp"

// Thermal views bundled with each other. Edges that two modalities share lie a little beside each
// other (heat spreads, paint ends elsewhere than form), all round the orbit in the same way, which
// a focal length and a distance that are both too short explain well. Patches of a thermal view
// found again in its neighbours have no such bias: they hold the views against each other and the
// lens, and the visible scene's surface and edges hold where that is. Internal to recon/poses;
// errors: the renderer's, cancelled.
namespace orbitfuse {

/// Rounds of one kind, at most so many, until no view moves any more.
struct BundleStep {
  int reach_px;  ///< of the search for a patch about where the poses have it
  int max_rounds;
  double settled_deg;                      ///< no view turns by more: enough
  std::vector<double> sighting_losses_px;  ///< Cauchy scales of a patch found again, one solve each
};

struct ThermalBundleOptions {
  int width_px = 320;  ///< of images and depth
  ThermalTrackOptions tracks;
  double surface_sigma = 0.02;  ///< of the visible field's surface, share of the distance
  /// Poses may be a few pixels off, single ones 6 degrees; the first scale lets go of patches that
  /// confirm any place on their way (a view of `sedan` stayed 2.4 degrees off without it).
  BundleStep wide{
      .reach_px = 6, .max_rounds = 4, .settled_deg = 0.3, .sighting_losses_px = {2, 0.5}};
  /// To the end: single views jitter by a tenth of a degree.
  BundleStep fine{.reach_px = 3, .max_rounds = 3, .settled_deg = 0.2, .sighting_losses_px = {0.5}};
  /// A k1 that moves the outer tenth of the patches by less is none: straight lenses of eight
  /// scenes came out with up to 0.3 px, depth being a little off everywhere.
  double least_radial_px = 0.5;
  double edge_weight = 0.03;  ///< of an edge found in the visible scene: biased, and many
  int max_iterations = 40;
};

/// All views, their common focal length, and the k1 that `orbit`'s images show beside it
/// (`alignment.radial`). Patches are looked for among views that are not
/// dropped; those are held by the visible scene's edges alone. Each of them says how many of its
/// patches others confirm. Where fewer than half of the views have enough of them, or the solve
/// fails, nothing moves. `agreement`, `matches` and `median_px` stay those of the edges before:
/// the caller measures them again.
Status bundle_thermal(const OrbitRefinement& refinement, const FocalGuess& prior,
                      const ThermalBundleOptions& options, Fit& alignment);

/// The added views alone, each by its patches found again in the settled ones, which stay where
/// they are; so does the lens. Each says how many of its patches the settled ones confirm.
Status bundle_added(const OrbitRefinement& refinement, const std::vector<std::size_t>& added,
                    const std::vector<std::size_t>& settled, const ThermalBundleOptions& options,
                    Fit& alignment);

}  // namespace orbitfuse
