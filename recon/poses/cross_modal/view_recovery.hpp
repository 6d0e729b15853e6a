// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/alignment/render_alignment.hpp"
#include "recon/poses/cross_modal/orbit_views.hpp"

// A view that was aligned wrongly agrees less with its render than the others do, and its
// neighbours on the loop say where it should be.
namespace orbitfuse {

/// How well the lens is known. A focal sigma of 0 counts as 1e-4; a radial one of 0 holds k1 at
/// none.
struct LensSigmas {
  double focal_relative = 0.03, radial = 0;  ///< k1 about none
};

/// From views aligned to a degree or so to the end. Every view must come back to its place from
/// where its loop, judged by the better half of its views, predicts it; one that doesn't is
/// searched as a whole (whole_view.hpp), and what is supported better is kept. Then all views
/// together. The lens' focal length changes in every view of `alignment`; where its k1 shows
/// (`alignment.radial`), the images of `orbit` are straightened. Errors: the renderer's, cancelled.
Status refine_orbit(const SceneRenderer& renderer, OrbitViews& orbit, RenderAlignment& alignment,
                    const LensSigmas& lens, const Progress& progress);

/// Azimuth less nominal azimuth of the orbit's stations, by its better supported views.
double station_offset_deg(const OrbitViews& orbit, const RenderAlignment& alignment);

/// The views of `orbit` from index `first_new` on, which have a station but no pose yet, posed
/// among the others, which stay as they are; the lens is theirs. Each must be found at the same
/// place by the visible scene and by the temperatures of the views posed before
/// (painted_scene.hpp); one that isn't after a search from either place and as a whole is dropped.
/// Errors as above.
Status add_views(const SceneRenderer& renderer, const OrbitViews& orbit, std::size_t first_new,
                 RenderAlignment& alignment, const Progress& progress);

}  // namespace orbitfuse
