// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "recon/nerf/field/occupancy.hpp"

namespace orbitfuse::nerf::test {

/// Blocks of cells that are empty, of which nothing is known, and of holes and densities.
inline Occupancy mixed_grid(int resolution, int cascades, cv::RNG& random) {
  Occupancy grid;
  grid.create(resolution, cascades);
  for (std::size_t block = 0; block < grid.on.size(); ++block) {
    const int kind = random.uniform(0, 3);
    grid.on[block] = kind == 0 ? 0 : ~std::uint64_t{0};
    for (std::size_t cell = 64 * block; kind == 2 && cell < 64 * (block + 1); ++cell) {
      grid.density[cell] = random.uniform(0.0f, 8.0f);
      Occupancy::put(grid.on, static_cast<std::int64_t>(cell), random.uniform(0, 2) == 1);
    }
  }
  grid.refresh();
  return grid;
}

}  // namespace orbitfuse::nerf::test
