// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "core/host_device.hpp"

// What the draws of training rays go by, wherever they are made: the same keys give the same rays.
namespace orbitfuse::nerf {

enum Stream : std::uint64_t { pixel_stream = 1, jitter_stream = 2, probe_stream = 4 };

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

/// Within so many pixels of the object, the background trains with every ray.
ORBITFUSE_HOST_DEVICE inline int background_rim_px(int width) {
  const int share = width / 50;
  return share < 4 ? 4 : share > 100 ? 100 : share;
}

}  // namespace orbitfuse::nerf
