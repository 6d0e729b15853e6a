// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "recon/depth/stereo/patch_match.hpp"

namespace orbitfuse::depth {

/// Keeps depths that match well and that other views confirm: there the same surface has the same
/// depth and leads back to the same pixel. A depth that hides surfaces matched elsewhere is
/// dropped. Depths and confidences in the scene's units; NaN and 0 where nothing is known.
std::vector<DepthMap> confirmed_depths(const std::vector<DepthView>& views,
                                       const std::vector<PlaneMap>& planes,
                                       const std::vector<std::vector<int>>& neighbours,
                                       const DepthOptions& options);

}  // namespace orbitfuse::depth
