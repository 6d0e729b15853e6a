// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/alignment/scene_renderer.hpp"
#include "recon/alignment/view_verdict.hpp"

// Thermal views aligned with renders of the visible scene from where they are believed to be: small
// patches round rendered edges (of brightness and of depth) are found again in the thermal image by
// sign-free gradient orientation, and all poses and the shared lens follow in one robust bundle.
// What the renderer shows is what is visible from there: no line behind a wall takes part.
namespace orbitfuse {

/// One round: render, match, solve.
struct RenderRound {
  int width_px = 160;        ///< of the render; the thermal image is reduced alike
  int search_px = 20;        ///< reach of the whole view's first shift
  int patch_search_px = 8;   ///< reach of each patch beyond it
  int patch_radius_px = 10;  ///< large patches are rarely mistaken, small ones are exact
  int patch_spacing_px = 8;
};

/// From several degrees off to about one, and from there to the end.
inline std::vector<RenderRound> coarse_rounds() {
  return {{.width_px = 160, .search_px = 30, .patch_search_px = 14, .patch_radius_px = 22},
          {.width_px = 160, .search_px = 12, .patch_search_px = 10, .patch_radius_px = 16},
          {.width_px = 160, .search_px = 6, .patch_search_px = 7, .patch_radius_px = 10}};
}
inline std::vector<RenderRound> fine_rounds() {
  return {{.width_px = 320, .search_px = 6, .patch_search_px = 7, .patch_radius_px = 12},
          {.width_px = 320, .search_px = 4, .patch_search_px = 6, .patch_radius_px = 10}};
}

struct RenderAlignmentOptions {
  std::vector<RenderRound> rounds = coarse_rounds();
  double focal_relative_sigma = 0.03;  ///< 0: the lens is settled, each view is solved alone
  /// Of the prior, at the images' size; absent: the focal length that the first view comes with.
  std::optional<double> prior_focal_px = {};
};

struct RenderAlignedView {
  PosedView view;
  double agreement = 0;  ///< mean, of rendered edges with the image's, as the last round found them
  /// Patches within 2 px of that round's answer, across the edges that they hold: along one they
  /// may be off by more. Finer renders have more of them.
  int matches = 0;
  double median_px = 0;  ///< their residual, in pixels of the last round
  ViewVerdict verdict;
  /// Patches that other views of its modality show where its pose has them; none where nobody was
  /// asked.
  std::optional<int> confirmed_patches;
  /// Compares places of one view. Agreement alone favours a place with few edges, the number of
  /// patches alone one with many.
  double support() const { return agreement * matches; }
};

struct RenderAlignment {
  std::vector<RenderAlignedView> views;
  double focal_px = 0;
  /// k1 of the images' lens (Brown, normalised coordinates), where somebody has looked for it: the
  /// cameras here are straight.
  double radial = 0;
  double radial_px = 0;  ///< by how much it shifts what was found far out
  std::vector<PosedView> poses() const;
};

/// Refines `views` (images: CV_32FC1 of the cameras' size). Errors: the renderer's, cancelled.
Result<RenderAlignment> align_with_renders(const SceneRenderer& renderer,
                                           const std::vector<cv::Mat>& images,
                                           const std::vector<PosedView>& views,
                                           const RenderAlignmentOptions& options,
                                           const Progress& progress);

}  // namespace orbitfuse
