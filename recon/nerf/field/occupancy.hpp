// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace orbitfuse::nerf {

/// Which cells of space may hold matter: nested cubes ("cascades") of half extent 1, 2, 4, ...
/// normalised units, `resolution`^3 cells each (a multiple of 16). A cell outside `allowed` never
/// comes on. Cells are stored in blocks of 4x4x4: a block's bits are one word and its codes one
/// cache line, so that a ray that walks through reads each once, and skips an empty one in a step.
struct Occupancy {
  int resolution = 0, cascades = 0;
  std::vector<std::uint64_t> on, allowed;  ///< bit per cell
  /// Decaying maximum of T * sigma: the density that the best of the rays through a cell sees. What
  /// is hidden behind surfaces is not worth samples either.
  std::vector<float> density;
  std::vector<std::uint8_t> code;     ///< density in steps of 5 %, for marching
  std::vector<float> window;          ///< maximum since the last update; -1 = not visited
  std::vector<std::int64_t> visited;  ///< cells whose window is set

  void create(int cells_per_axis, int cascade_count);
  std::int64_t cell_count() const {
    return static_cast<std::int64_t>(resolution) * resolution * resolution * cascades;
  }
  static bool test(const std::vector<std::uint64_t>& bits, std::int64_t cell) {
    return bits[static_cast<std::size_t>(cell >> 6)] >> (cell & 63) & 1u;
  }
  static void put(std::vector<std::uint64_t>& bits, std::int64_t cell, bool value) {
    const std::uint64_t bit = std::uint64_t{1} << (cell & 63);
    auto& word = bits[static_cast<std::size_t>(cell >> 6)];
    word = value ? word | bit : word & ~bit;
  }
  /// Cascade of a normalised point: the smallest cube that holds it (>= cascades: outside all).
  static int cascade_of(const float x[3]);
  std::int64_t cell_of(int cascade, const float x[3]) const {
    const float scale = 0.5f * static_cast<float>(resolution) / static_cast<float>(1 << cascade);
    const float half = 0.5f * static_cast<float>(resolution);
    int i[3];
    for (int d = 0; d < 3; ++d)
      i[d] = std::clamp(static_cast<int>(x[d] * scale + half), 0, resolution - 1);
    return index_of(cascade, i);
  }
  float cell_size(int cascade) const {
    return 2.0f * static_cast<float>(1 << cascade) / static_cast<float>(resolution);
  }
  void center_of(std::int64_t cell, float x[3]) const;
  /// Of whole-cell coordinates within a cascade, and back.
  std::int64_t index_of(int cascade, const int i[3]) const {
    const std::int64_t blocks = resolution / 4;
    const std::int64_t block =
        ((cascade * blocks + (i[2] >> 2)) * blocks + (i[1] >> 2)) * blocks + (i[0] >> 2);
    return block * 64 + ((i[2] & 3) << 4 | (i[1] & 3) << 2 | (i[0] & 3));
  }
  int coordinates_of(std::int64_t cell, int i[3]) const;  ///< returns the cascade
  /// Cells and codes as they were; densities follow from the codes.
  void restore(const std::vector<std::uint64_t>& cells_on, const std::vector<std::uint8_t>& codes);
  /// Derived arrays, after `on` or `density` were set from outside.
  void refresh();

  /// What marching reads of a cell: 0 = off, else 1 + code. A block is one cache line.
  std::vector<std::uint8_t> look;
  /// Bits per block, small enough for the L1 cache: a cell of it is on; all are, and nothing else
  /// is known.
  std::vector<std::uint64_t> any, plain;
  double fraction_on() const;

  /// Notes a visible density found at a point.
  void record(const float x[3], float sigma);
  /// Applies the window: visited cells take max(old * decay, window) and stay on while
  /// their opacity, density * cell size, is at least min(threshold, half the mean).
  void update(float decay, float threshold);

 private:
  void sum_up(std::int64_t block);    ///< its bits in `any` and `plain`
  void show(std::int64_t cell);       ///< sets its byte in `look`
  std::vector<std::uint64_t> coded_;  ///< bit per cell: its code isn't 0
};

const float* densities_of_codes();  ///< [256]

}  // namespace orbitfuse::nerf
