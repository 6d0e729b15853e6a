// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "core/geometry/transform.hpp"
#include "recon/measurement/thermal_scene.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::measurement {

/// A trained thermal field in a world that need not be its own: depths come out in world units.
/// Where its opacity is below `min_opacity` it has no temperature.
FieldRenderer field_renderer(std::shared_ptr<const nerf::Field> thermal,
                             const Similarity3d& world_from_thermal, double min_opacity = 0.5);

/// Depth of the surface that is exported (FieldSurfaceOptions), from a field in a world that need
/// not be its own.
DepthRenderer surface_renderer(std::shared_ptr<const nerf::Field> field,
                               const Similarity3d& world_from_field);

}  // namespace orbitfuse::measurement
