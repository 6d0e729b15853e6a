// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/level_plane.hpp"
#include "core/geometry/reconstruction.hpp"
#include "core/result.hpp"
#include "recon/depth/stereo/depth_view.hpp"

namespace orbitfuse::depth {

/// The plane under all cameras that most confirmed depths lie on, nothing below it: the plain that
/// an object stands on, as far out as the cameras, in the views' unit, the scene radius. `maps`:
/// one a view, in that unit. Errors: quality (there is none; why).
Result<LevelPlane> find_ground(const std::vector<DepthView>& views,
                               const std::vector<DepthMap>& maps, std::uint64_t seed);

}  // namespace orbitfuse::depth
