// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "recon/nerf/dataset.hpp"

namespace orbitfuse::nerf {

struct LevelSample {
  int view;
  double level, weight = 1;
};
/// What several views see of one point.
using LevelSight = std::vector<LevelSample>;

/// Where two views or more that train see a point of one of their maps, and what of it views held
/// out see.
struct LevelSights {
  std::vector<LevelSight> seen, by_heldout;
};

/// Of even places that no camera clipped, as many as tell: about 33,000, seen by 24 views that
/// train, spread over the orbit. What views held out show changes nothing of what the others do.
LevelSights level_sights(const Dataset& data, const std::vector<DepthMap>& depth,
                         const std::vector<bool>& heldout);

}  // namespace orbitfuse::nerf
