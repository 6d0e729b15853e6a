// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/alignment/scene_renderer.hpp"

// Renders of a trained field are what alignment spends its time on, and most of them differ by a
// degree or by less. A render with depth is a surface: seen from beside, it costs a hundredth.
namespace orbitfuse {

struct KeyframeOptions {
  /// Renders up to this width are made of the keyframes nearest to them, wherever those are: they
  /// find places, they don't measure them.
  int coarse_width_px = 200;
  int coarse_keyframes = 3;  ///< that such a render is made of
  int first_width_px = 256;  ///< of the keyframes at given views
  /// Wider renders are made of one keyframe within this turn, seen from the orbit's centre and by
  /// the camera's axes; where there is none yet, the scene is rendered once more.
  double max_turn_deg = 1.0;
  double max_distance_change = 0.03;  ///< relative to the orbit's centre
  double looser = 2;                  ///< these two, for renders narrower than `fine_width_px`
  int fine_width_px = 320;            ///< of those keyframes, without their margin
  /// Between neighbouring pixels of one surface, relative; larger steps are edges of occlusion.
  double max_depth_step = 0.06;
};

/// Renders of `renderer` reused for cameras near by. Keyframes at `views` (may be empty) come
/// first; `center` is what the cameras look at. `renderer` must outlive the result, which may be
/// called from two threads at once up to `coarse_width_px` alone, and only where there are views:
/// other renders add keyframes.
/// Errors: the renderer's, cancelled.
Result<SceneRenderer> keyframe_scene(const SceneRenderer& renderer,
                                     const std::vector<PosedView>& views,
                                     const Eigen::Vector3d& center, const KeyframeOptions& options,
                                     const Progress& progress);

}  // namespace orbitfuse
