// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/occupancy.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace orbitfuse::nerf {

void Occupancy::create(int cells_per_axis, int cascade_count) {
  resolution = cells_per_axis;
  cascades = cascade_count;
  const auto cells = static_cast<std::size_t>(cell_count());
  on.assign((cells + 63) / 64, ~std::uint64_t{0});
  allowed = on;
  density.assign(cells, 0);
  window.assign(cells, -1);
}

int Occupancy::cascade_of(const float x[3]) {
  const float far = std::max({std::abs(x[0]), std::abs(x[1]), std::abs(x[2])});
  if (far < 1.0f) return 0;
  // ilogb(1) = 0 lies just outside the unit cube, so it belongs to cascade 1.
  return static_cast<int>((std::bit_cast<std::uint32_t>(far) >> 23) & 0xFF) - 127 + 1;
}

std::int64_t Occupancy::cell_of(int cascade, const float x[3]) const {
  const float scale = 0.5f * static_cast<float>(resolution) / static_cast<float>(1 << cascade);
  const float half = 0.5f * static_cast<float>(resolution);
  int i[3];
  for (int d = 0; d < 3; ++d)
    i[d] = std::clamp(static_cast<int>(x[d] * scale + half), 0, resolution - 1);
  return ((static_cast<std::int64_t>(cascade) * resolution + i[2]) * resolution + i[1]) * resolution +
         i[0];
}

void Occupancy::center_of(std::int64_t cell, float x[3]) const {
  const std::int64_t n = resolution;
  const int cascade = static_cast<int>(cell / (n * n * n));
  const std::int64_t local = cell % (n * n * n);
  const std::int64_t i[3] = {local % n, local / n % n, local / (n * n)};
  for (int d = 0; d < 3; ++d)
    x[d] = (static_cast<float>(i[d]) + 0.5f) * cell_size(cascade) - static_cast<float>(1 << cascade);
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

void Occupancy::update(float decay, float threshold, float dt_min) {
  const std::int64_t per_cascade = static_cast<std::int64_t>(resolution) * resolution * resolution;
  double sum = 0;
  const auto opacity = [&](std::int64_t cell, float sigma) {
    return sigma * dt_min * static_cast<float>(1 << (cell / per_cascade));
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
    window[i] = -1;
  }
  visited.clear();
}

int march(const Occupancy& occupancy, const Ray& ray, const MarchSettings& settings, float jitter,
          float* t_out, float* dt_out) {
  float inverse[3];
  for (int d = 0; d < 3; ++d)
    inverse[d] = std::abs(ray.direction[d]) > 1e-9f ? 1.0f / ray.direction[d]
                                                    : std::numeric_limits<float>::max();
  const float far_edge = static_cast<float>(1 << (occupancy.cascades - 1));
  int count = 0;
  float t = settings.near + jitter * std::max(settings.dt_min, settings.cone * settings.near);
  // A camera far outside all cascades first advances to the largest cube.
  for (int d = 0; d < 3; ++d) {
    const float gap = std::abs(ray.origin[d]) - far_edge;
    if (gap <= 0) continue;
    if (ray.origin[d] * ray.direction[d] >= 0) return 0;
    t = std::max(t, gap * std::abs(inverse[d]) * 1.0001f);
  }
  while (count < settings.max_samples) {
    float dt = std::max(settings.dt_min, settings.cone * t);
    const float middle = t + 0.5f * dt;
    float x[3];
    for (int d = 0; d < 3; ++d) x[d] = ray.origin[d] + middle * ray.direction[d];
    const int cascade = Occupancy::cascade_of(x);
    if (cascade >= occupancy.cascades) break;
    const std::int64_t cell = occupancy.cell_of(cascade, x);
    if (Occupancy::test(occupancy.on, cell)) {
      if (settings.stretch > 1 && occupancy.density[static_cast<std::size_t>(cell)] *
                                          occupancy.cell_size(cascade) < surface_opacity)
        dt *= settings.stretch;
      t_out[count] = t + 0.5f * dt;
      dt_out[count++] = dt;
      t += dt;
      continue;
    }
    // To the far side of this empty cell, in steps of dt so that samples keep their jitter.
    const float size = occupancy.cell_size(cascade);
    float exit = std::numeric_limits<float>::max();
    for (int d = 0; d < 3; ++d) {
      const float edge = (std::floor(x[d] / size) + (ray.direction[d] > 0 ? 1.0f : 0.0f)) * size;
      const float distance = (edge - x[d]) * inverse[d];
      if (std::abs(ray.direction[d]) > 1e-9f) exit = std::min(exit, distance);
    }
    t += std::max(1.0f, std::ceil(exit / dt)) * dt;
  }
  return count;
}

}  // namespace orbitfuse::nerf
