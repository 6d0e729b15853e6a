// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/launch.hpp"
#include "recon/nerf/kernels/kernels.hpp"

// The hash grid on a device (as HashEncoding): a thread a sample and level.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

constexpr int most_levels = 16;

struct Levels {
  GridLevel level[most_levels];
  float weight[most_levels];  ///< coarse to fine: 0..1
  int count, features;
};

struct Corners {
  std::uint32_t entry[8];
  float weight[8];
};

ORBITFUSE_HOST_DEVICE inline Corners corners_of(const GridLevel& level, const float position[3]) {
  float part[3];
  std::uint32_t base[3];
  const float resolution = static_cast<float>(level.resolution);
  for (int d = 0; d < 3; ++d) {
    // Positions at the upper border belong to the last cell; anything else outside is a caller's
    // bug that must not become a wild address.
    const float scaled = position[d] * resolution, top = resolution - 1e-3f;
    const float low = scaled > 0 ? scaled : 0.0f, inside = low < top ? low : top;
    base[d] = static_cast<std::uint32_t>(inside);
    part[d] = inside - static_cast<float>(base[d]);
  }
  Corners out;
  for (unsigned c = 0; c < 8; ++c) {
    const unsigned x = c & 1u, y = c >> 1 & 1u, z = c >> 2;
    const std::uint32_t at[3] = {base[0] + x, base[1] + y, base[2] + z};
    const auto row = static_cast<std::uint32_t>(level.resolution + 1);
    out.entry[c] = level.dense ? at[0] + row * (at[1] + row * at[2])
                               : (at[0] ^ at[1] * 2654435761u ^ at[2] * 805459861u) & level.mask;
    out.weight[c] =
        (x ? part[0] : 1 - part[0]) * (y ? part[1] : 1 - part[1]) * (z ? part[2] : 1 - part[2]);
  }
  return out;
}

template <int features>
struct alignas(2 * features) HalfEntry {
  std::uint16_t v[features];
};

template <int features>
struct Encode {
  Levels levels;
  const std::uint16_t* half;
  Rows position01;  ///< 3
  SampleCount samples;
  Rows out;  ///< levels * features

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const int l = i / samples.bound, s = i % samples.bound;
    if (s >= *samples.counted) return;
    float sum[features] = {};
    const float weight = levels.weight[l];
    if (weight > 0) {
      const GridLevel& level = levels.level[l];
      const float at[3] = {position01(0, s), position01(1, s), position01(2, s)};
      const Corners corners = corners_of(level, at);
      const auto* table = reinterpret_cast<const HalfEntry<features>*>(half + level.offset);
      for (int c = 0; c < 8; ++c) {
        const HalfEntry<features> entry = table[corners.entry[c]];
        for (int f = 0; f < features; ++f) sum[f] += corners.weight[c] * float_of_half(entry.v[f]);
      }
    }
    for (int f = 0; f < features; ++f) out(l * features + f, s) = weight * sum[f];
  }
};

/// The gradient of what Encode read, added up exactly: the same for any order of threads. One that
/// is not finite clears `finite`.
template <int features>
struct Scatter {
  Levels levels;
  Rows position01;
  SampleCount samples;
  Rows dfeatures;
  long long* gradient;  ///< as the table, in fixed_unit
  int* finite;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const int l = i / samples.bound, s = i % samples.bound;
    if (s >= *samples.counted) return;
    float d[features];
    bool any = false;
    for (int f = 0; f < features; ++f) {
      d[f] = dfeatures(l * features + f, s);
      if (!is_finite(d[f])) {
        *finite = 0;
        return;
      }
      d[f] *= levels.weight[l];
      any = any || d[f] != 0.0f;
    }
    if (!any) return;
    const GridLevel& level = levels.level[l];
    const float at[3] = {position01(0, s), position01(1, s), position01(2, s)};
    const Corners corners = corners_of(level, at);
    for (int c = 0; c < 8; ++c) {
      long long* to = gradient + level.offset + static_cast<long long>(corners.entry[c]) * features;
      for (int f = 0; f < features; ++f) add_to(to + f, fixed_of(corners.weight[c] * d[f]));
    }
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
