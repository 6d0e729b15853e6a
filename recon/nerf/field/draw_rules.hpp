// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "core/host_device.hpp"
#include "core/numeric/random.hpp"

// What the draws of training rays go by, wherever they are made: the same keys give the same rays.
namespace orbitfuse::nerf {

enum Stream : std::uint64_t { pixel_stream = 1, even_stream = 2, probe_stream = 4 };

inline constexpr int draw_attempts = 8;  ///< for a ray: pixels that show nothing are passed over
inline constexpr float known_depth_margin = 1.08f;  ///< a wrong depth must be able to move
/// Far from the object before a plain background: the ray meets no cell. Some are drawn all the
/// same, for the background's colour.
inline constexpr int background_every = 16;
/// While sparse points count, one ray in so many goes through them.
inline constexpr int known_every = 4;
inline constexpr int occupancy_probes = 4096;  ///< cells beside occupied ones, looked at each time
inline constexpr int probe_attempts = 16;  ///< times as many draws, most of which are no such cell

/// Known distances that are few are points of SfM: a tenth of the pixels is more than these are.
inline bool points_are_sparse(std::int64_t known, std::int64_t pixels) {
  return known > 0 && known < pixels / 10;
}

ORBITFUSE_HOST_DEVICE inline std::uint64_t draw_key(int step, int ray, int attempt) {
  const std::uint64_t key =
      static_cast<std::uint64_t>(step) * 1000003u + static_cast<std::uint64_t>(ray);
  return key * draw_attempts + static_cast<unsigned>(attempt);
}

/// A square of pixels of a view that trains (smaller at the edges), with what each of its pixels
/// weighs in the draw.
struct PixelTile {
  int view, x, y, columns, rows;
  std::uint32_t weight;
};
inline constexpr int tile_px = 8;

/// All tiles' pixels one after the other, as long as they weigh; `ends`: where each tile's end.
struct PixelTilesView {
  const PixelTile* tiles;
  const std::uint64_t* ends;
  int count;
};
struct DrawnPixel {
  int view, x, y;
};
/// The first of the running sums `ends` that lies behind `pick`; std::upper_bound, on a device too.
template <class Number>
ORBITFUSE_HOST_DEVICE inline int first_beyond(const Number* ends, int count, Number pick) {
  int low = 0, beyond = count;
  while (low < beyond) {
    const int middle = (low + beyond) / 2;
    if (ends[middle] > pick)
      beyond = middle;
    else
      low = middle + 1;
  }
  return low;
}
/// `draw` of [0, 2^64).
ORBITFUSE_HOST_DEVICE inline DrawnPixel pixel_at(const PixelTilesView& of, std::uint64_t draw) {
  const std::uint64_t all = of.ends[of.count - 1];
  // One rounding, and so the same on every machine.
  auto pick = static_cast<std::uint64_t>(static_cast<double>(draw >> 11) * 0x1p-53 *
                                         static_cast<double>(all));
  if (pick >= all) pick = all - 1;
  const int found = first_beyond(of.ends, of.count, pick);
  const PixelTile& tile = of.tiles[found];
  const auto pixel = static_cast<int>((pick - (found > 0 ? of.ends[found - 1] : 0)) / tile.weight);
  return {tile.view, tile.x + pixel % tile.columns, tile.y + pixel / tile.columns};
}

/// What draws a ray's pixel: the first attempts of a run's rays, one after the other, lie evenly
/// over all pixels, whichever stretch of them is looked at. Fields learn more from them than from
/// as many at random (docs/notes/nerf.md).
ORBITFUSE_HOST_DEVICE inline std::uint64_t pixel_bits(std::uint64_t seed, std::uint64_t ray,
                                                      int attempt, std::uint64_t random) {
  return attempt > 0 ? random : even_bits(random_bits(seed, even_stream, 0), golden_share, ray);
}
ORBITFUSE_HOST_DEVICE inline float ray_jitter(std::uint64_t seed, std::uint64_t ray) {
  return uniform01(even_bits(random_bits(seed, even_stream, 1), silver_share, ray));
}

/// Within so many pixels of the object, the background trains with every ray.
ORBITFUSE_HOST_DEVICE inline int background_rim_px(int width) {
  const int share = width / 50;
  return share < 4 ? 4 : share > 100 ? 100 : share;
}

}  // namespace orbitfuse::nerf
