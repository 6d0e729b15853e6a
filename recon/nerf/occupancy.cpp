// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/occupancy.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/memory.hpp"

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
  const std::int64_t high[3] = {block % blocks, block / blocks % blocks, block / (blocks * blocks) % blocks};
  for (int d = 0; d < 3; ++d) i[d] = static_cast<int>(high[d]) * 4 + low[d];
  return static_cast<int>(block / (blocks * blocks * blocks));
}

void Occupancy::center_of(std::int64_t cell, float x[3]) const {
  int i[3];
  const int cascade = coordinates_of(cell, i);
  for (int d = 0; d < 3; ++d)
    x[d] = (static_cast<float>(i[d]) + 0.5f) * cell_size(cascade) - static_cast<float>(1 << cascade);
}

namespace {

constexpr float codes_per_octave = 14.5f;  // 255 codes reach e^12, the highest density

std::uint8_t code_of(float density) {
  return static_cast<std::uint8_t>(
      std::clamp(std::lround(codes_per_octave * std::log2(1 + density)), 0l, 255l));
}

struct Decoded {
  float density[256];
  Decoded() {
    for (int i = 0; i < 256; ++i) density[i] = std::exp2(static_cast<float>(i) / codes_per_octave) - 1;
  }
};

const Decoded& decoded() {
  static const Decoded table;
  return table;
}

}  // namespace

void Occupancy::refresh() {
  code.resize(density.size());
  reserve_huge(march_words, 2 * on.size());
  march_words.assign(2 * on.size(), 0);
  any.assign((on.size() + 63) / 64, 0);
  for (std::size_t b = 0; b < on.size(); ++b) {
    march_words[2 * b] = on[b];
    put(any, static_cast<std::int64_t>(b), on[b] != 0);
  }
  for (std::size_t i = 0; i < density.size(); ++i) {
    code[i] = density[i] > 0 ? code_of(density[i]) : std::uint8_t{0};
    if (code[i] > 0) march_words[2 * (i >> 6) + 1] |= std::uint64_t{1} << (i & 63);
  }
}

void Occupancy::restore(const std::vector<std::uint64_t>& cells_on, const std::vector<std::uint8_t>& codes) {
  on = cells_on;
  for (std::size_t i = 0; i < density.size(); ++i) density[i] = decoded().density[codes[i]];
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
    march_words[2 * (i >> 6)] = on[i >> 6];
    put(any, c >> 6, on[i >> 6] != 0);
    put(march_words, (c >> 6) * 128 + 64 + (c & 63), code[i] > 0);
    window[i] = -1;
  }
  visited.clear();
}

namespace {

/// The stretch of a ray inside one occupied cell.
struct Segment {
  float begin, length;
  float surface;  ///< opacity expected there
  float haze;     ///< share of the samples that look everywhere
  bool plain;     ///< nothing is known of it but that it may be occupied
};

constexpr int max_segments = 4096;  // a diagonal through all cascades of 256 cells needs 2300

/// Occupied cells along the ray, nearest first.
int segments_of(const Occupancy& occupancy, const Ray& ray, float near, float far, Segment* out) {
  float inverse[3];
  for (int d = 0; d < 3; ++d)
    inverse[d] = 1.0f / (std::abs(ray.direction[d]) > 1e-9f ? ray.direction[d]
                                                            : std::copysign(1e-9f, ray.direction[d]));
  const float far_edge = static_cast<float>(1 << (occupancy.cascades - 1));
  float t = near;
  // A camera outside all cascades first advances to the largest cube.
  for (int d = 0; d < 3; ++d) {
    const float gap = std::abs(ray.origin[d]) - far_edge;
    if (gap <= 0) continue;
    if (ray.origin[d] * ray.direction[d] >= 0) return 0;
    t = std::max(t, gap * std::abs(inverse[d]) * 1.0001f);
  }
  const Decoded& table = decoded();
  int count = 0;
  for (int guard = 0; t < far && guard < 8 * max_segments && count < max_segments; ++guard) {
    float x[3];
    for (int d = 0; d < 3; ++d) x[d] = ray.origin[d] + t * ray.direction[d];
    const int cascade = Occupancy::cascade_of(x);
    if (cascade >= occupancy.cascades) break;
    const float size = occupancy.cell_size(cascade);
    const std::int64_t cell = occupancy.cell_of(cascade, x);
    const bool empty = !Occupancy::test(occupancy.any, cell >> 6);
    const std::uint64_t* words = &occupancy.march_words[2 * static_cast<std::size_t>(cell >> 6)];
    // A block that is empty, or of which nothing is known, in one step.
    const bool plain = !empty && words[0] == ~std::uint64_t{0} && words[1] == 0;
    const float step = empty || plain ? 4 * size : size;
    const float per_step = 1 / step;
    float exit = std::numeric_limits<float>::max();
    for (int d = 0; d < 3; ++d) {
      const float edge = (std::floor(x[d] * per_step) + (inverse[d] > 0 ? 1.0f : 0.0f)) * step;
      exit = std::min(exit, (edge - x[d]) * inverse[d]);
    }
    exit = std::max(exit, 0.0f) + 1e-3f * size;  // across the border in spite of rounding
    if (!empty && (words[0] >> (cell & 63) & 1u)) {
      const int code = words[1] >> (cell & 63) & 1u ? occupancy.code[static_cast<std::size_t>(cell)] : 0;
      Segment* last = count > 0 ? &out[count - 1] : nullptr;
      if (code == 0 && last && last->plain && t <= last->begin + last->length + 1e-5f) {
        last->length += exit;
        last->haze += exit / size;
      } else {
        // depth / (1 + depth) stands for 1 - exp(-depth): only relative sizes matter here.
        const float depth = exit * table.density[code];
        out[count++] = {t, exit, depth / (1 + depth), exit / size, code == 0};
      }
    }
    t += exit;
  }
  return count;
}

}  // namespace

int march(const Occupancy& occupancy, const Ray& ray, const MarchSettings& settings, float jitter,
          float* t, float* dt) {
  thread_local std::vector<Segment> segments(max_segments);
  const int cells = segments_of(occupancy, ray, settings.near, settings.far, segments.data());
  if (cells == 0) return 0;
  float surface = 0, haze = 0;
  for (int i = 0; i < cells; ++i) {
    surface += segments[static_cast<std::size_t>(i)].surface;
    haze += segments[static_cast<std::size_t>(i)].haze;
  }
  const float for_surface = static_cast<float>(settings.surface) * std::min(1.0f, surface);
  const float for_haze = std::clamp(haze, 2.0f, std::max(2.0f, static_cast<float>(settings.haze)));
  const int count = std::min(max_ray_samples, static_cast<int>(std::ceil(for_surface + for_haze)));
  const float surface_share = surface > 0 ? for_surface / surface : 0.0f, haze_share = for_haze / haze;

  // Inverse transform sampling: `mass` runs to for_surface + for_haze in steps of one sample.
  const float per_sample = (for_surface + for_haze) / static_cast<float>(count);
  int cell = 0;
  float mass_before = 0, length_before = 0;
  const auto density_of_cell = [&](int i) {
    const Segment& s = segments[static_cast<std::size_t>(i)];
    return s.surface * surface_share + s.haze * haze_share;
  };
  const auto advance = [&](float mass) {  // occupied length and distance at this mass
    float own = density_of_cell(cell);
    while (cell + 1 < cells && mass_before + own < mass) {
      mass_before += own;
      length_before += segments[static_cast<std::size_t>(cell)].length;
      own = density_of_cell(++cell);
    }
    const Segment& s = segments[static_cast<std::size_t>(cell)];
    const float part = std::clamp((mass - mass_before) / std::max(own, 1e-12f), 0.0f, 1.0f);
    return std::pair{length_before + part * s.length, s.begin + part * s.length};
  };
  float edge = 0;
  const float shift = 0.5f * (jitter - 0.5f);  // samples keep to the middle half of their stratum
  for (int k = 0; k < count; ++k) {
    t[k] = advance((static_cast<float>(k) + 0.5f + shift) * per_sample).second;
    const float next = advance(static_cast<float>(k + 1) * per_sample).first;
    dt[k] = std::max(0.0f, next - edge);
    edge = next;
  }
  return count;
}

}  // namespace orbitfuse::nerf
