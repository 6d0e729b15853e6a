// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/session.hpp"
#include "recon/poses/render_alignment.hpp"

// A view that was aligned wrongly agrees less with its render than the others do, and its
// neighbours on the loop say where it should be.
namespace orbitfuse {

struct OrbitViews {
  std::vector<cv::Mat> images;
  std::vector<Station> stations;
  Similarity3d canonical_from_world;  ///< z up, origin at the orbit's centre
  bool clockwise = false;
};

/// The camera turned about the orbit's axis, degrees counter-clockwise seen from above.
Rigid3d turned(const Rigid3d& cam_from_world, const Similarity3d& canonical_from_world, double degrees);

/// Views whose agreement reaches a share of what the better quarter reaches, with enough matches.
std::vector<bool> supported_views(const RenderAlignment& alignment);

/// Starts every unsupported view again from its neighbours' poses, turned to its station, and keeps
/// what agrees better; repeated while that helps. Errors: the renderer's, cancelled.
Status rescue_views(const SceneRenderer& renderer, const OrbitViews& orbit, RenderAlignment& alignment,
                    const Progress& progress);

}  // namespace orbitfuse
