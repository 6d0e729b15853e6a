// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "recon/poses/cross_modal/orbit_views.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/known/session_poses.hpp"
#include "recon/poses/known/slips.hpp"

// Known thermal poses held against the visible scene that they should stand in: nothing else of a
// run would say that they live in another world, belong to other images, or have another lens'
// focal length. Internal to recon/poses; errors: the renderer's, cancelled.
namespace orbitfuse {

/// Of few images one's own is soon the best.
inline constexpr std::size_t least_views_to_judge = 6;

/// What renders of the visible scene say of given thermal poses.
struct SceneJudgement {
  int views = 0;        ///< judged: all or, of few, none
  int best_of_all = 0;  ///< whose own image fits the render from there better than any other one
  /// From the given poses to where the views' edges place them in the scene: of the centre as seen
  /// from the orbit's middle, or of the turn if that is larger. Nothing where few have enough
  /// edges.
  std::optional<double> median_apart_deg;
  double median_correlation = 0;  ///< of an image with what the others' temperatures paint there
  bool contradicted = false;      ///< the poses as a whole
  std::optional<Slip> slip;       ///< that would explain it; its fit: the share best of all
  /// What speaks against a view: form and temperatures, or one of them.
  NamedViews wrong, doubtful;
};

/// `orbit`: images (CV_32FC1 of the views' cameras' size, as lenses without distortion would have
/// seen them) and its canonical world; stations may be absent. `scene` is asked for narrow renders
/// only.
Result<SceneJudgement> judge_by_scene(const SceneRenderer& scene, const OrbitViews& orbit,
                                      const std::vector<PosedView>& views,
                                      const Progress& progress);

/// Why known poses as a whole are not believed.
struct Contradiction {
  std::string words;
  double true_focal = 1;  ///< Slip::true_focal
};

/// Judges `poses`, which share the visible scene's world if they are right: single views that
/// nothing supports are dropped, others doubted, both by name. Nothing is returned where they are
/// believed.
Result<std::optional<Contradiction>> check_by_scene(const Session& session,
                                                    const VisibleScene& visible,
                                                    const Progress& progress, ModalityPoses& poses);

}  // namespace orbitfuse
