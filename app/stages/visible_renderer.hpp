// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/progress.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse::stages {

/// The visible field as pose refinement looks at it: fewer samples a ray than pictures need. Both
/// arguments must outlive it.
SceneRenderer edge_renderer(const nerf::Field& field, const Progress& progress);

}  // namespace orbitfuse::stages
