// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/render_alignment.hpp"

// One round of bringing two reconstructions together by images: render the visible scene from the
// thermal cameras, find its patches in their images, and solve for the one similarity they agree
// on.
namespace orbitfuse {

/// One patch of the visible scene in one thermal view.
struct ScenePatch {
  PatchMatch match;
  Eigen::Vector3d point;  ///< in the visible world
  Rigid3d cam_from_thermal;
  Camera camera;
};

struct SimilarityRound {
  std::vector<ScenePatch> patches;
  double agreement = 0;  ///< of rendered edges with the images' where they were rendered, -1..1

  /// Patches that the similarity brings to within 2 px of where they were found.
  int matches(const Similarity3d& thermal_from_visible) const;
};

/// Fewer patches are too few to move seven parameters by.
inline constexpr std::size_t fewest_patches = 30;

/// Errors: the renderer's, cancelled.
Result<SimilarityRound> match_scene(const SceneRenderer& visible,
                                    const std::vector<cv::Mat>& images,
                                    const std::vector<PosedView>& thermal,
                                    const Similarity3d& visible_from_thermal,
                                    const RenderRound& round, const Progress& progress);

/// The similarity that the patches agree on, the robust scale lowered step by step; the given one
/// where they determine none.
Similarity3d agreed_similarity(const std::vector<ScenePatch>& patches,
                               const Similarity3d& thermal_from_visible);

}  // namespace orbitfuse
