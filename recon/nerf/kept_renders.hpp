// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/nerf/field.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf {

/// What a field shows where its recorded views stand, by their names: the point cloud and the
/// detail of new views ask for the same renders. Those that no longer fit in `most_bytes` are
/// rendered each time.
struct KeptRenders {
  struct Kept {
    Camera camera;
    Rigid3d cam_from_world;
    RenderedView seen;
  };
  std::size_t most_bytes = std::size_t{1} << 28;
  std::size_t bytes = 0;
  std::map<std::string, Kept> by_name = {};
};

/// How they are rendered: 0.01 dB worse than every pixel all the way, a fifth faster.
inline const RenderOptions where_views_stand = {.alike = 0.01};

/// The view as `field` shows it to `camera` (the view's own but for its size): kept, or rendered
/// and kept in the place of an earlier one. `kept` may be null; views of one name are of one field.
/// Errors: as render().
Result<RenderedView> render_where_it_stands(const Field& field, const PosedView& view,
                                            const Camera& camera, KeptRenders* kept,
                                            const Progress& progress);

}  // namespace orbitfuse::nerf
