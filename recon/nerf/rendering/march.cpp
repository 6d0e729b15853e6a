// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/march.hpp"

#include <immintrin.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

namespace orbitfuse::nerf {
namespace {

/// The stretch of a ray inside one occupied cell.
struct Segment {
  float begin, length;
  float surface;  ///< opacity expected there
  float haze;     ///< share of the samples that look everywhere
  bool plain;     ///< nothing is known of it but that it may be occupied
};

constexpr int max_segments = 4096;  // a diagonal through all cascades of 256 cells needs 2300

/// Occupied cells along one ray, nearest first.
struct Segments {
  int count = 0;
  Segment list[max_segments];

  /// `plain`: nothing is known of it; `cells`: how many it crosses.
  void add(float begin, float length, float surface, float cells, bool plain) {
    Segment* last = count > 0 ? &list[count - 1] : nullptr;
    if (plain && last && last->plain && begin <= last->begin + last->length + 1e-5f) {
      last->length += length;
      last->haze += cells;
      return;
    }
    if (count < max_segments) list[count++] = {begin, length, surface, cells, plain};
  }
};

/// Rays side by side; one that has ended, or isn't there, has t = far.
struct alignas(32) Lanes {
  float origin[3][march_lanes] = {}, direction[3][march_lanes] = {}, inverse[3][march_lanes] = {};
  float t[march_lanes] = {}, far[march_lanes] = {};

  void set(int lane, const DrawnRay& given, float near, const Occupancy& occupancy) {
    const float far_edge = static_cast<float>(1 << (occupancy.cascades - 1));
    t[lane] = std::max(near, given.near);
    far[lane] = given.far;
    for (int d = 0; d < 3; ++d) {
      const float o = given.ray.origin[d], along = given.ray.direction[d];
      origin[d][lane] = o;
      direction[d][lane] = along;
      inverse[d][lane] = 1.0f / (std::abs(along) > 1e-9f ? along : std::copysign(1e-9f, along));
      const float gap = std::abs(o) - far_edge;
      if (gap <= 0 && std::isfinite(along)) continue;
      // A camera outside all cascades first advances to the largest cube. (NaN gets here, and
      // ends.)
      if (!(o * along < 0)) far[lane] = 0;
      t[lane] = std::max(t[lane], gap * std::abs(inverse[d][lane]) * 1.0001f);
    }
  }
};

__m256i and1(__m256i v) { return _mm256_and_si256(v, _mm256_set1_epi32(1)); }
__m256i is_one(__m256i bit) { return _mm256_cmpeq_epi32(bit, _mm256_set1_epi32(1)); }
void store(std::int32_t* out, __m256i v) { _mm256_store_si256(reinterpret_cast<__m256i*>(out), v); }
/// 32-bit words of a little-endian array, zero in the other lanes.
template <typename T>
__m256i gather(const std::vector<T>& words, __m256i index, __m256i lanes) {
  return _mm256_mask_i32gather_epi32(_mm256_setzero_si256(),
                                     reinterpret_cast<const int*>(words.data()), index, lanes, 4);
}
__m256i bit_of(const std::vector<std::uint64_t>& words, __m256i index) {
  const __m256i word = gather(words, _mm256_srli_epi32(index, 5), _mm256_set1_epi32(-1));
  return is_one(and1(_mm256_srlv_epi32(word, _mm256_and_si256(index, _mm256_set1_epi32(31)))));
}

/// Where the rays have been, one entry of all lanes a turn.
struct Walk {
  struct alignas(32) Turn {
    float begin[march_lanes], length[march_lanes], size[march_lanes];
    std::int32_t cell[march_lanes];                  ///< -1: nothing there
    float surface[march_lanes], cells[march_lanes];  ///< of what is on
    int on, known;  ///< a bit a lane: a cell is on; its density is known
  };
  int count = 0;
  std::vector<Turn> turns = std::vector<Turn>(512);  ///< grows to what rays need
};

/// Crosses blocks cell by cell, empty and plain ones in one step. What the next step waits for is
/// small enough to stay in the L1 cache; cells' contents are asked for, not read.
void walk_through(const Occupancy& grid, const Lanes& lanes, Walk& walk) {
  const __m256 half_resolution = _mm256_set1_ps(0.5f * static_cast<float>(grid.resolution));
  const __m256 cell_per_cube = _mm256_set1_ps(grid.cell_size(0));
  const __m256i top = _mm256_set1_epi32(grid.resolution - 1),
                blocks = _mm256_set1_epi32(grid.resolution / 4),
                per_layer = _mm256_mullo_epi32(blocks, blocks),
                per_level = _mm256_mullo_epi32(per_layer, blocks), one = _mm256_set1_epi32(1);
  const __m256i three = _mm256_set1_epi32(3), bias = _mm256_set1_epi32(127);
  const __m256 far = _mm256_load_ps(lanes.far), sign = _mm256_set1_ps(-0.0f);
  __m256 t = _mm256_load_ps(lanes.t);
  walk.count = 0;
  for (int step_count = 0; step_count < 8 * max_segments; ++step_count) {
    __m256 x[3];
    for (int d = 0; d < 3; ++d)
      x[d] = _mm256_add_ps(_mm256_load_ps(lanes.origin[d]),
                           _mm256_mul_ps(t, _mm256_load_ps(lanes.direction[d])));
    // The smallest cube that holds the point, as Occupancy::cascade_of.
    const __m256 outwards =
        _mm256_max_ps(_mm256_max_ps(_mm256_andnot_ps(sign, x[0]), _mm256_andnot_ps(sign, x[1])),
                      _mm256_andnot_ps(sign, x[2]));
    const __m256i exponent = _mm256_srli_epi32(_mm256_castps_si256(outwards), 23);
    const __m256i cascade = _mm256_max_epi32(_mm256_sub_epi32(exponent, _mm256_set1_epi32(126)),
                                             _mm256_setzero_si256());
    const __m256 inside =
        _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(grid.cascades), cascade));
    const __m256 live = _mm256_and_ps(_mm256_cmp_ps(t, far, _CMP_LT_OQ), inside);
    if (_mm256_testz_ps(live, live)) return;
    const __m256i level =
        _mm256_and_si256(cascade, _mm256_castps_si256(live));  // others must read something, too
    const __m256 size = _mm256_mul_ps(
        cell_per_cube, _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_add_epi32(level, bias), 23)));
    const __m256 scale = _mm256_mul_ps(
        half_resolution, _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_sub_epi32(bias, level), 23)));
    __m256i cell = _mm256_setzero_si256(), places[3];
    // Both ways out, of the cell and of its block, are known before it is which of them is taken.
    __m256 cell_exit = _mm256_set1_ps(std::numeric_limits<float>::max()), block_exit = cell_exit;
    for (int d = 2; d >= 0; --d) {
      const __m256i i = _mm256_min_epi32(
          _mm256_max_epi32(
              _mm256_cvttps_epi32(_mm256_add_ps(_mm256_mul_ps(x[d], scale), half_resolution)),
              _mm256_setzero_si256()),
          top);
      places[d] = _mm256_srli_epi32(i, 2);
      cell = _mm256_or_si256(_mm256_slli_epi32(cell, 2), _mm256_and_si256(i, three));
      const __m256 inverse = _mm256_load_ps(lanes.inverse[d]);
      const __m256i forward =
          _mm256_andnot_si256(_mm256_srai_epi32(_mm256_castps_si256(inverse), 31), one);
      const auto way_out = [&](__m256i edge) {
        const __m256 at =
            _mm256_mul_ps(_mm256_sub_ps(_mm256_cvtepi32_ps(edge), half_resolution), size);
        return _mm256_mul_ps(_mm256_sub_ps(at, x[d]), inverse);
      };
      cell_exit = _mm256_min_ps(cell_exit, way_out(_mm256_add_epi32(i, forward)));
      block_exit = _mm256_min_ps(
          block_exit, way_out(_mm256_slli_epi32(_mm256_add_epi32(places[d], forward), 2)));
    }
    const __m256i block =
        _mm256_add_epi32(_mm256_add_epi32(_mm256_mullo_epi32(level, per_level),
                                          _mm256_mullo_epi32(places[2], per_layer)),
                         _mm256_add_epi32(_mm256_mullo_epi32(places[1], blocks), places[0]));
    const __m256i any = bit_of(grid.any, block), plain = bit_of(grid.plain, block);
    const __m256 by_cell = _mm256_castsi256_ps(_mm256_andnot_si256(plain, any));
    __m256 exit = _mm256_blendv_ps(block_exit, cell_exit, by_cell);
    // Across the border in spite of rounding.
    exit = _mm256_add_ps(_mm256_max_ps(exit, _mm256_setzero_ps()),
                         _mm256_mul_ps(size, _mm256_set1_ps(1e-3f)));
    const __m256i matter = _mm256_and_si256(any, _mm256_castps_si256(live));
    if (!_mm256_testz_si256(matter, matter)) {
      if (walk.count == static_cast<int>(walk.turns.size()))
        walk.turns.resize(2 * walk.turns.size());
      Walk::Turn& turn = walk.turns[static_cast<std::size_t>(walk.count++)];
      _mm256_store_ps(turn.begin, t);
      _mm256_store_ps(turn.length, exit);
      _mm256_store_ps(turn.size, size);
      const __m256i index = _mm256_or_si256(_mm256_slli_epi32(block, 6), cell);
      store(turn.cell, _mm256_blendv_epi8(_mm256_set1_epi32(-1), index, matter));
      for (const std::int32_t there : turn.cell)  // look_up_cells asks for them next
        _mm_prefetch(reinterpret_cast<const char*>(grid.look.data() + std::max(there, 0)),
                     _MM_HINT_T0);
    }
    t = _mm256_add_ps(t, _mm256_and_ps(exit, live));
  }
}

/// What the cells hold. No cell waits for another one's memory.
void look_up_cells(const Occupancy& grid, Walk& walk) {
  const float* const densities = densities_of_codes();
  const __m256 one = _mm256_set1_ps(1);
  for (int k = 0; k < walk.count; ++k) {
    Walk::Turn& turn = walk.turns[static_cast<std::size_t>(k)];
    const __m256i cell = _mm256_load_si256(reinterpret_cast<const __m256i*>(turn.cell));
    const __m256i there = _mm256_cmpgt_epi32(cell, _mm256_set1_epi32(-1));
    const __m256i four = gather(grid.look, _mm256_srli_epi32(cell, 2), there);
    const __m256i shift = _mm256_slli_epi32(_mm256_and_si256(cell, _mm256_set1_epi32(3)), 3);
    const __m256i look = _mm256_and_si256(_mm256_srlv_epi32(four, shift), _mm256_set1_epi32(255));
    const auto bits = [](__m256i mask) { return _mm256_movemask_ps(_mm256_castsi256_ps(mask)); };
    const __m256i known = _mm256_cmpgt_epi32(look, _mm256_set1_epi32(1));
    turn.on = bits(_mm256_cmpgt_epi32(look, _mm256_setzero_si256()));
    turn.known = bits(known);
    if (turn.on == 0) continue;
    const __m256 length = _mm256_load_ps(turn.length);
    _mm256_store_ps(turn.cells, _mm256_div_ps(length, _mm256_load_ps(turn.size)));
    __m256 surface = _mm256_setzero_ps();
    if (turn.known != 0) {
      const __m256 density = _mm256_mask_i32gather_ps(_mm256_setzero_ps(), densities,
                                                      _mm256_sub_epi32(look, _mm256_set1_epi32(1)),
                                                      _mm256_castsi256_ps(known), 4);
      // depth / (1 + depth) stands for 1 - exp(-depth): only relative sizes matter here.
      const __m256 depth = _mm256_mul_ps(length, density);
      surface = _mm256_div_ps(depth, _mm256_add_ps(one, depth));
    }
    _mm256_store_ps(turn.surface, surface);
  }
}

/// The rays' occupied cells.
void collect(const Walk& walk, Segments* out) {
  for (int lane = 0; lane < march_lanes; ++lane) out[lane].count = 0;
  for (int k = 0; k < walk.count; ++k) {
    const Walk::Turn& turn = walk.turns[static_cast<std::size_t>(k)];
    for (auto on = static_cast<unsigned>(turn.on); on != 0; on &= on - 1) {
      const int lane = __builtin_ctz(on);
      out[lane].add(turn.begin[lane], turn.length[lane], turn.surface[lane], turn.cells[lane],
                    (turn.known >> lane & 1) == 0);
    }
  }
}

void place_samples(const Segments& found, const MarchSettings& settings, float jitter,
                   Marched& out) {
  const Segment* segments = found.list;
  const int cells = found.count;
  out.count = 0;
  if (cells == 0) return;
  float surface = 0, haze = 0;
  for (int i = 0; i < cells; ++i) {
    surface += segments[i].surface;
    haze += segments[i].haze;
  }
  const SampleSpread spread = spread_of(surface, haze, settings);

  // Inverse transform sampling: `mass` runs in steps of one sample over what all stretches get.
  const auto mass_of = [&](const Segment& s) {
    return s.surface * spread.surface_share + s.haze * spread.haze_share;
  };
  const Segment *at = segments, *const last = segments + cells - 1;
  float own = mass_of(*at), per_mass = 1 / std::max(own, 1e-12f);
  float mass_before = 0, length_before = 0;
  const auto part_at = [&](float mass) {  // of the cell in which this mass is reached
    while (at != last && mass_before + own < mass) {
      mass_before += own;
      length_before += at->length;
      own = mass_of(*++at);
      per_mass = 1 / std::max(own, 1e-12f);
    }
    return std::clamp((mass - mass_before) * per_mass, 0.0f, 1.0f);
  };
  float edge = 0;
  const float shift = 0.5f * (jitter - 0.5f);  // samples keep to the middle half of their stratum
  for (int k = 0; k < spread.count; ++k) {
    const float middle = part_at((static_cast<float>(k) + 0.5f + shift) * spread.per_sample);
    out.t[k] = at->begin + middle * at->length;
    const float whole = part_at(static_cast<float>(k + 1) * spread.per_sample);
    const float next = length_before + whole * at->length;
    out.dt[k] = std::max(0.0f, next - edge);
    edge = next;
  }
  out.count = spread.count;
}

}  // namespace

void march(const Occupancy& occupancy, const MarchSettings& settings, const DrawnRay* rays,
           int count, Marched* out) {
  assert(count >= 0 && count <= march_lanes);
  thread_local Walk walk;
  thread_local Segments segments[march_lanes];
  Lanes lanes;
  for (int i = 0; i < count; ++i) lanes.set(i, rays[i], settings.near, occupancy);
  walk_through(occupancy, lanes, walk);
  look_up_cells(occupancy, walk);
  collect(walk, segments);
  for (int i = 0; i < count; ++i) {
    place_samples(segments[i], settings, rays[i].jitter, out[i]);
  }
}

}  // namespace orbitfuse::nerf
