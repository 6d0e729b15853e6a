// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/modality.hpp"
#include "core/session/session.hpp"
#include "drivers/synthetic/orbit.hpp"

namespace orbitfuse::synthetic {

/// One exposure of the walk: what really happened and what the operator believes.
struct Exposure {
  Rigid3d cam_from_world;
  double azimuth_deg = 0, elevation_deg = 0;  ///< true
  Station nominal;
  bool tracking = false;
  double time_s = 0;  ///< since the walk began
};

Camera camera_of(const OrbitOptions& orbit);
const OrbitOptions& orbit_of(const SyntheticOptions& options, Modality modality);
/// In capture order, tracking exposures between their stations.
std::vector<Exposure> walk(const SyntheticOptions& options, Modality modality);
/// Poses that belong to neither orbit, between the loops, for held-out test views.
std::vector<Rigid3d> test_poses(const SyntheticOptions& options);
Camera test_camera(const SyntheticOptions& options);

}  // namespace orbitfuse::synthetic
