// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <vector>

#include "recon/alignment/render_alignment.hpp"
#include "recon/poses/cross_modal/orbit_views.hpp"

// What refining an orbit against renders works with; internal to recon/poses.
namespace orbitfuse {

using Fit = RenderAlignment;

/// What is known of the lens before anything is aligned.
struct FocalGuess {
  double focal_px = 0, relative_sigma = 0.03;
  double radial_sigma = 0;  ///< of k1 about none; 0: the images are straight
};

/// How much better a restart must be: two places this close in score are one, seen twice.
constexpr double clearly_better = 1.02;

/// From where a loop predicts a view, several degrees off.
inline std::vector<RenderRound> wide_rounds() {
  return {{.width_px = 160, .search_px = 16, .patch_search_px = 12, .patch_radius_px = 18},
          {.width_px = 160, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 12}};
}
/// To a fraction of a degree, and where places are compared.
inline std::vector<RenderRound> judging_rounds() {
  return {{.width_px = 256, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 12},
          {.width_px = 256, .search_px = 5, .patch_search_px = 6, .patch_radius_px = 10}};
}

/// Where the stations of the orbit lie, as the better half of its aligned views says.
struct LoopModel {
  double offset_deg = 0;                        ///< azimuth - nominal azimuth
  std::map<int, double> loop_offset_deg;        ///< of its own: each walk starts a little elsewhere
  std::map<int, double> elevation_deg, radius;  ///< by loop

  double azimuth_deg(const OrbitViews& orbit, std::size_t view) const;
};

/// The views that are kept, sure or doubtful.
std::vector<std::size_t> not_dropped(const Fit& alignment);

LoopModel loop_model(const OrbitViews& orbit, const Fit& alignment);

/// The view's place as its loop predicts it; where no view of the loop is posed, its own.
PosedView predicted(const OrbitViews& orbit, const Fit& alignment, const LoopModel& model,
                    std::size_t view);

/// The larger of how far two poses lie apart as seen from the orbit's centre, and their turn.
double apart_deg(const OrbitViews& orbit, const Rigid3d& a, const Rigid3d& b);
/// Within a degree: a restart that ends there confirms the view's pose.
bool same_place(const OrbitViews& orbit, const Rigid3d& a, const Rigid3d& b);

/// Restarts of views of one orbit in one scene. The renderer is asked for several coarse views at
/// once (KeyframeOptions::coarse_width_px), finer ones one by one. Errors: the renderer's,
/// cancelled.
struct OrbitRefinement {
  const SceneRenderer& renderer;
  const OrbitViews& orbit;
  const Progress& progress;

  /// The chosen views from given places, one at a time: the lens is settled.
  Result<Fit> restart(const std::vector<std::size_t>& chosen, const std::vector<PosedView>& starts,
                      std::vector<RenderRound> rounds) const;
  /// All views from where they are, with their common lens.
  Status together(Fit& alignment, const FocalGuess& prior, std::vector<RenderRound> rounds) const;
  /// The chosen views searched as wholes from where their loop predicts them; not aligned yet.
  Result<std::vector<PosedView>> search(const std::vector<std::size_t>& chosen,
                                        const Fit& alignment) const;
};

}  // namespace orbitfuse
