// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "recon/nerf/field/draw_rules.hpp"
#include "recon/nerf/training/scene.hpp"

namespace orbitfuse::nerf {

/// What training draws rays from: the pixels of the views that train, in tiles. A smooth part is
/// learned from fewer rays than one with texture.
struct PixelTiles {
  std::vector<PixelTile> tiles;
  std::vector<std::uint64_t> ends;  ///< running sum of what the tiles' pixels weigh

  /// `texture_share` of the draw follows the standard deviation within tiles (up to four times its
  /// mean), the rest is even. Tiles without any value are left out, unless there are no others.
  static PixelTiles of(const std::vector<NormalisedView>& views, const std::vector<bool>& heldout,
                       double texture_share);
  PixelTilesView view() const {
    return {tiles.data(), ends.data(), static_cast<int>(tiles.size())};
  }
};

}  // namespace orbitfuse::nerf
