// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/progress.hpp"
#include "recon/alignment/scene_renderer.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse {

/// The visible field as pose refinement looks at it: brightness and depth, at fewer samples a ray
/// than pictures need. Both arguments must outlive it.
SceneRenderer edge_renderer(const nerf::Field& field, const Progress& progress);

/// Depth of a field of either modality, likewise; brightness stays empty.
SceneRenderer depth_renderer(const nerf::Field& field, const Progress& progress);

}  // namespace orbitfuse
