// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/alignment/scene_renderer.hpp"

// The visible scene's form painted with the temperatures of views that are already posed. A view of
// the same modality finds its place in it by all its edges, not only by those that both modalities
// share: a second opinion that doesn't have the first one's mistakes.
namespace orbitfuse {

struct PaintedSceneOptions {
  int width_px = 320;             ///< of the painting images and their depth
  int painters = 3;               ///< views that paint a render: those seen from nearest by
  double depth_tolerance = 0.03;  ///< relative; beyond it the painter sees something else there
  /// Views turned by less don't paint: a view that is itself a painter must be judged by others.
  double min_turn_deg = 0;
};

/// A view that lends its image to others.
struct Painter {
  Camera camera;  ///< without distortion, of the image's size
  Rigid3d cam_from_world;
  cv::Mat image, depth;  ///< CV_32FC1; NaN where there is no surface
};

/// What the painter saw of a depth map's pixels, CV_32FC1; NaN where it saw something else, or
/// nothing. `depth_tolerance`: relative.
cv::Mat painted_by(const Painter& painter, const cv::Mat& depth, const Camera& camera,
                   const Rigid3d& cam_from_world, double depth_tolerance);

/// Renders with `renderer`'s depth and brightness from `images` (CV_32FC1) of `views`, NaN where no
/// painter sees. Painters differ by an offset (drift), which is taken out. `renderer` must outlive
/// the result. Errors: the renderer's, cancelled.
Result<SceneRenderer> painted_scene(const SceneRenderer& renderer,
                                    const std::vector<PosedView>& views,
                                    const std::vector<cv::Mat>& images,
                                    const PaintedSceneOptions& options, const Progress& progress);

/// Normalised correlation, -1 to 1, of a view's image with what a painted scene shows from its
/// place; nothing where too little of it is painted. Errors: the renderer's.
Result<std::optional<double>> correlation_with(const SceneRenderer& painted, const cv::Mat& image,
                                               const PosedView& view);

}  // namespace orbitfuse
