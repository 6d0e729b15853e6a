// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field/occupancy.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/system/memory.hpp"
#include "recon/nerf/field/occupancy_codes.hpp"

namespace orbitfuse::nerf {

void Occupancy::create(int cells_per_axis, int cascade_count) {
  resolution = cells_per_axis;
  cascades = cascade_count;
  const auto cells = static_cast<std::size_t>(cell_count());
  on.assign((cells + 63) / 64, ~std::uint64_t{0});
  allowed = on;
  reserve_huge(density, cells);
  density.assign(cells, 0);
  code.assign(cells, 0);
  window.assign(cells, -1);
  refresh();
}

int Occupancy::cascade_of(const float x[3]) {
  const float far = std::max({std::abs(x[0]), std::abs(x[1]), std::abs(x[2])});
  if (far < 1.0f) return 0;
  // ilogb(1) = 0 lies just outside the unit cube, so it belongs to cascade 1.
  return static_cast<int>((std::bit_cast<std::uint32_t>(far) >> 23) & 0xFF) - 127 + 1;
}

int Occupancy::coordinates_of(std::int64_t cell, int i[3]) const {
  const std::int64_t blocks = resolution / 4, block = cell >> 6;
  const int low[3] = {static_cast<int>(cell & 3), static_cast<int>(cell >> 2 & 3),
                      static_cast<int>(cell >> 4 & 3)};
  const std::int64_t high[3] = {block % blocks, block / blocks % blocks,
                                block / (blocks * blocks) % blocks};
  for (int d = 0; d < 3; ++d) i[d] = static_cast<int>(high[d]) * 4 + low[d];
  return static_cast<int>(block / (blocks * blocks * blocks));
}

void Occupancy::center_of(std::int64_t cell, float x[3]) const {
  int i[3];
  const int cascade = coordinates_of(cell, i);
  for (int d = 0; d < 3; ++d)
    x[d] =
        (static_cast<float>(i[d]) + 0.5f) * cell_size(cascade) - static_cast<float>(1 << cascade);
}

namespace {

std::uint8_t code_of(float density) { return static_cast<std::uint8_t>(code_of_density(density)); }

struct Decoded {
  float density[256];
  Decoded() {
    for (int i = 0; i < 256; ++i) density[i] = density_of_code(i);
  }
};

}  // namespace

const float* densities_of_codes() {
  static const Decoded table;
  return table.density;
}

void Occupancy::refresh() {
  code.resize(density.size());
  reserve_huge(look, density.size());
  look.resize(density.size());
  coded_.assign(on.size(), 0);
  any.assign((on.size() + 63) / 64, 0);
  plain = any;
  for (std::size_t i = 0; i < density.size(); ++i) {
    code[i] = density[i] > 0 ? code_of(density[i]) : std::uint8_t{0};
    show(static_cast<std::int64_t>(i));
  }
  for (std::size_t b = 0; b < on.size(); ++b) sum_up(static_cast<std::int64_t>(b));
}

void Occupancy::show(std::int64_t cell) {
  const auto i = static_cast<std::size_t>(cell);
  put(coded_, cell, code[i] > 0);
  look[i] =
      test(on, cell) ? static_cast<std::uint8_t>(1 + std::min<int>(code[i], 254)) : std::uint8_t{0};
}

void Occupancy::sum_up(std::int64_t block) {
  const auto b = static_cast<std::size_t>(block);
  put(any, block, on[b] != 0);
  put(plain, block, on[b] == ~std::uint64_t{0} && coded_[b] == 0);
}

void Occupancy::restore(const std::vector<std::uint64_t>& cells_on,
                        const std::vector<std::uint8_t>& codes) {
  on = cells_on;
  for (std::size_t i = 0; i < density.size(); ++i) density[i] = densities_of_codes()[codes[i]];
  refresh();
}

double Occupancy::fraction_on() const {
  std::int64_t count = 0;
  for (const std::uint64_t word : on) count += std::popcount(word);
  return static_cast<double>(count) / static_cast<double>(std::max<std::int64_t>(1, cell_count()));
}

void Occupancy::record(const float x[3], float sigma) {
  const int cascade = cascade_of(x);
  if (cascade >= cascades) return;
  const std::int64_t cell = cell_of(cascade, x);
  float& seen = window[static_cast<std::size_t>(cell)];
  if (seen < 0) visited.push_back(cell);
  seen = std::max(seen, sigma);
}

void Occupancy::update(float decay, float threshold) {
  const std::int64_t per_cascade = static_cast<std::int64_t>(resolution) * resolution * resolution;
  double sum = 0;
  const auto opacity = [&](std::int64_t cell, float sigma) {
    return sigma * cell_size(static_cast<int>(cell / per_cascade));
  };
  for (const std::int64_t c : visited) {
    float& value = density[static_cast<std::size_t>(c)];
    value = std::max(value * decay, window[static_cast<std::size_t>(c)]);
    sum += std::min(1.0f, opacity(c, value));
  }
  if (visited.empty()) return;
  const float limit =
      std::min(threshold, static_cast<float>(0.5 * sum / static_cast<double>(visited.size())));
  for (const std::int64_t c : visited) {
    const auto i = static_cast<std::size_t>(c);
    put(on, c, test(allowed, c) && opacity(c, density[i]) >= limit);
    code[i] = code_of(density[i]);
    show(c);
    sum_up(c >> 6);
    window[i] = -1;
  }
  visited.clear();
}

}  // namespace orbitfuse::nerf
