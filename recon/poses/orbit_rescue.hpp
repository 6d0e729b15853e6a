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

/// Views whose agreement reaches a share of what the better quarter reaches, with enough matches.
std::vector<bool> supported_views(const RenderAlignment& alignment);

/// From views aligned to a degree or so to the end. Every view must come back to its place from
/// where its loop, judged by the better half of its views, predicts it; one that doesn't is searched
/// as a whole (whole_view.hpp), and what is supported better is kept. Then all views together.
/// The lens' focal length changes in every view of `alignment`. Errors: the renderer's, cancelled.
Status refine_orbit(const SceneRenderer& renderer, const OrbitViews& orbit, RenderAlignment& alignment,
                    double focal_relative_sigma, const Progress& progress);

}  // namespace orbitfuse
