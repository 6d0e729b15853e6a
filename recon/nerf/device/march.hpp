// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/rays.hpp"
#include "recon/nerf/field/contraction.hpp"
#include "recon/nerf/field/march_settings.hpp"
#include "recon/nerf/field/occupancy_codes.hpp"
#include "recon/nerf/field/traced_ray.hpp"

// Samples along rays on a device, as march() places them. A ray's next cell depends on its last,
// and a step's rays are few: each ray's way is walked in pieces, side by side, which note the
// occupied stretches; then each ray shares out its samples.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// Occupancy as marching reads it.
struct Cells {
  int resolution, cascades;
  const std::uint8_t* look;
  const std::uint64_t *any, *plain;
};

constexpr int most_steps = 8 * 4096;  // of a walk that gets nowhere; a diagonal needs 2300

/// The stretch of a ray inside one occupied cell, or a block of cells of which nothing is known.
struct alignas(16) Segment {
  float begin, length, surface, haze;  ///< surface 0: nothing is known of it
};

ORBITFUSE_HOST_DEVICE inline bool bit_of(const std::uint64_t* bits, long at) {
  return bits[at >> 6] >> (at & 63) & 1u;
}
ORBITFUSE_HOST_DEVICE inline int bounded(int value, int last) {
  return value < 0 ? 0 : value > last ? last : value;
}
/// Where |x| (the largest coordinate) lies: the exponent of its smallest cube.
ORBITFUSE_HOST_DEVICE inline int cascade_of(const float x[3]) {
  const float far = fmaxf(fmaxf(fabsf(x[0]), fabsf(x[1])), fabsf(x[2]));
  std::uint32_t bits;
  memcpy(&bits, &far, sizeof(bits));
  const int exponent = static_cast<int>(bits >> 23) - 126;
  return far == far ? (exponent > 0 ? exponent : 0) : 129;
}

/// As Occupancy stores cells: in blocks of 4x4x4.
struct CellAddress {
  int block, cell;
  ORBITFUSE_HOST_DEVICE long index() const { return static_cast<long>(block) * 64 + cell; }
};
/// `per_cell`: cells of this cascade a normalised unit.
ORBITFUSE_HOST_DEVICE inline CellAddress address_of(int resolution, int cascade, float per_cell,
                                                    const float x[3]) {
  const float half = 0.5f * static_cast<float>(resolution);
  CellAddress at{cascade, 0};
  for (int d = 2; d >= 0; --d) {
    const int i = bounded(static_cast<int>(x[d] * per_cell + half), resolution - 1);
    at.block = at.block * (resolution >> 2) + (i >> 2);
    at.cell = at.cell << 2 | (i & 3);
  }
  return at;
}

/// One ray's way through the cells, a step at a time. Rays that stand side by side take their steps
/// together: a loop inside a step would make all wait for the longest.
class CellWalk {
 public:
  ORBITFUSE_HOST_DEVICE CellWalk(const Cells& cells, const DeviceRay& given, float near)
      : cells_(cells),
        half_(0.5f * static_cast<float>(cells.resolution)),
        t_(near > given.near ? near : given.near),
        far_(given.far) {
    const float far_edge = static_cast<float>(1 << (cells.cascades - 1));
    for (int d = 0; d < 3; ++d) {
      const float o = given.ray.origin[d], along = given.ray.direction[d];
      origin_[d] = o;
      direction_[d] = along;
      inverse_[d] = 1.0f / (fabsf(along) > 1e-9f ? along : copysignf(1e-9f, along));
      const float gap = fabsf(o) - far_edge;
      if (gap <= 0 && is_finite(along)) continue;
      // A camera outside all cascades first advances to the largest cube. (NaN gets here, and
      // ends.)
      if (!(o * along < 0)) far_ = 0;
      t_ = fmaxf(t_, gap * fabsf(inverse_[d]) * 1.0001f);
    }
    border_ = t_;
  }

  /// Where what comes next begins: a little before it is entered.
  ORBITFUSE_HOST_DEVICE float border() const { return border_; }
  /// Goes on from the first border behind `t`.
  ORBITFUSE_HOST_DEVICE void leap(float t) {
    t_ = border_ = t;
    Segment passed;
    bool occupied;
    step(passed, occupied);
  }

  /// Crosses a cell, or an empty or plain block. False: the way has ended. `occupied`: `out` says
  /// what was crossed.
  ORBITFUSE_HOST_DEVICE bool step(Segment& out, bool& occupied) {
    float x[3];
    for (int d = 0; d < 3; ++d) x[d] = origin_[d] + t_ * direction_[d];
    const int cascade = cascade_of(x);
    if (!(t_ < far_) || cascade >= cells_.cascades || ++steps_ > most_steps) return false;
    const float per_cell = half_ * power_of_two(-cascade);  // cells a normalised unit
    const CellAddress at = address_of(cells_.resolution, cascade, per_cell, x);
    // Read together: one doesn't wait for the other.
    const int look = cells_.look[at.index()];
    const bool any = bit_of(cells_.any, at.block), plain = bit_of(cells_.plain, at.block);
    const bool by_cell = any && !plain;
    const float size = 1.0f / per_cell;
    const float begin = t_, stride = by_cell ? 1.0f : 4.0f;
    const float exit = way_out(x, per_cell / stride, stride * size);
    const float length = exit + size * 1e-3f;  // across the border in spite of rounding
    border_ = t_ + exit;
    t_ += length;
    occupied = look != 0;
    if (!occupied) return true;
    // depth / (1 + depth) stands for 1 - exp(-depth): only relative sizes matter here.
    const float depth = length * density_of_code(look - 1);
    out = {begin, length, depth / (1 + depth), length * per_cell};
    return true;
  }

 private:
  ORBITFUSE_HOST_DEVICE static float power_of_two(int exponent) {
    const std::uint32_t bits = static_cast<std::uint32_t>(127 + exponent) << 23;
    float value;
    memcpy(&value, &bits, sizeof(value));
    return value;
  }
  ORBITFUSE_HOST_DEVICE float way_out(const float x[3], float per_step, float step) const {
    float exit = no_end;
    for (int d = 0; d < 3; ++d) {
      const float edge = (floorf(x[d] * per_step) + (inverse_[d] > 0 ? 1.0f : 0.0f)) * step;
      exit = fminf(exit, (edge - x[d]) * inverse_[d]);
    }
    return fmaxf(exit, 0.0f);
  }

  const Cells& cells_;
  float half_, origin_[3], direction_[3], inverse_[3], t_, border_, far_;
  int steps_ = 0;
};

/// A ray's pieces: 12 share the way through the innermost cube, where cells are smallest, and each
/// of the cubes round it has one before and one behind.
constexpr int near_pieces = 12, outer_pieces = 4, ray_pieces = near_pieces + 2 * outer_pieces;

/// Where a piece begins. At a distance u from the point nearest to the centre along a central ray a
/// cell is no smaller than u / sqrt(3) says: no piece crosses more than 0.8 * resolution cells.
ORBITFUSE_HOST_DEVICE inline float piece_begin(const Ray& ray, int piece) {
  constexpr float reach = 1.8f;  // a little over sqrt(3): beyond it no point is in the cube
  const float* o = ray.origin;
  const float middle = sqrtf(o[0] * o[0] + o[1] * o[1] + o[2] * o[2]);
  const auto doubled = [&](int times) { return reach * static_cast<float>(1 << times); };
  if (piece == 0) return 0;
  if (piece < outer_pieces) return middle - doubled(outer_pieces - piece);
  const int near = piece - outer_pieces;
  if (near <= near_pieces)
    return middle + reach * (2.0f * static_cast<float>(near) / near_pieces - 1.0f);
  const int beyond = near - near_pieces;
  return beyond < outer_pieces ? middle + doubled(beyond) : no_end;
}

/// Occupied stretches of all rays' pieces: slot s of piece p of ray r is at [(p * slots + s) * rays
/// + r].
struct Stretches {
  int rays, slots;
  Segment* segment;
  int* count;    ///< [piece][ray]
  Segment* sum;  ///< [piece][ray]: of surface and haze
  ORBITFUSE_HOST_DEVICE Segment& at(int piece, int slot, int ray) const {
    return segment[(static_cast<long>(piece) * slots + slot) * rays + ray];
  }
};

/// Where nothing is known, samples lie evenly, of whatever size the cells are.
ORBITFUSE_HOST_DEVICE inline bool joined(Segment& held, const Segment& next) {
  const bool plain = held.surface == 0 && next.surface == 0;
  if (!plain || next.begin > held.begin + held.length + 1e-5f) return false;
  held.length += next.length;
  held.haze += next.haze;
  return true;
}

struct WalkPieces {
  Cells cells;
  MarchSettings settings;
  const DeviceRay* rays;
  Stretches found;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const int r = i % found.rays, piece = i / found.rays;
    int count = 0;
    Segment held = {}, sum = {};
    if (rays[r].there) {
      const float begin = piece_begin(rays[r].ray, piece),
                  end = piece_begin(rays[r].ray, piece + 1);
      CellWalk walk(cells, rays[r], settings.near);
      // A stretch belongs to the piece that it begins in.
      if (begin > walk.border()) walk.leap(begin);
      Segment now;
      bool occupied = false;
      while (walk.border() < end && walk.step(now, occupied)) {
        if (!occupied) continue;
        sum.surface += now.surface;
        sum.haze += now.haze;
        if (count > 0 && joined(held, now)) continue;
        if (count == found.slots) {  // more than there is room for: the last takes it all
          held.length = now.begin + now.length - held.begin;
          held.surface += now.surface;
          held.haze += now.haze;
          continue;
        }
        if (count > 0) found.at(piece, count - 1, r) = held;
        held = now;
        ++count;
      }
    }
    if (count > 0) found.at(piece, count - 1, r) = held;
    found.count[i] = count;
    found.sum[i] = sum;
  }
};

struct CountSamples {
  MarchSettings settings;
  const DeviceRay* rays;
  Stretches found;
  SampleSpread* spread;
  int* counts;  ///< with one for the background

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    spread[r].count = 0;
    counts[r] = 0;
    if (!rays[r].there) return;
    counts[r] = 1;
    float surface = 0, haze = 0;
    for (int piece = 0; piece < ray_pieces; ++piece) {
      surface += found.sum[piece * found.rays + r].surface;
      haze += found.sum[piece * found.rays + r].haze;
    }
    if (!(haze > 0)) return;
    spread[r] = spread_of(surface, haze, settings);
    counts[r] = spread[r].count + 1;
  }
};

/// Samples of all rays, ray after ray; the last of each is the background: the point at infinity.
struct RaySamples {
  const int* first;        ///< of each ray, and behind the last
  float *t, *dt, *s, *ds;  ///< s = t / (1 + t), in which the distortion loss counts
  Rows position01;
};

/// Inverse transform sampling of a ray's segments.
struct PlaceSamples {
  const DeviceRay* rays;
  Stretches found;
  const SampleSpread* spread;
  RaySamples samples;

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    const DeviceRay& given = rays[r];
    if (!given.there) return;
    const SampleSpread& how = spread[r];
    int at = samples.first[r];
    if (how.count > 0) place(r, how, at);
    at += how.count;
    const float infinity[3] = {0.5f + 0.5f * given.ray.direction[0],
                               0.5f + 0.5f * given.ray.direction[1],
                               0.5f + 0.5f * given.ray.direction[2]};
    put(at, 1e6f, 0, infinity);
  }

 private:
  /// Where the running sum of what samples are shared out by reaches a sample's middle, and its
  /// end.
  struct Running {
    float mass = 0, length = 0;  ///< before the segment
    float edge = 0;              ///< occupied length up to the last sample's end
    float t = 0;                 ///< of the sample whose end comes next
    int passed = 0;              ///< middles and ends
  };

  ORBITFUSE_HOST_DEVICE void place(int r, const SampleSpread& how, int at) const {
    Segment held = {};
    Running running;
    bool holds = false;
    const auto mass_of = [&](const Segment& s) {
      return s.surface * how.surface_share + s.haze * how.haze_share;
    };
    for (int piece = 0; piece < ray_pieces; ++piece) {
      const int slots = found.count[piece * found.rays + r];
      Segment next = slots > 0 ? found.at(piece, 0, r) : Segment{};
      for (int slot = 0; slot < slots && running.passed < 2 * how.count; ++slot) {
        const Segment now = next;
        if (slot + 1 < slots) next = found.at(piece, slot + 1, r);  // on its way meanwhile
        if (holds && joined(held, now)) continue;
        if (holds) {
          const float own = mass_of(held);
          pass(rays[r], how, at, held, own, running.mass + own, running);
          running.mass += own;
          running.length += held.length;
        }
        held = now;
        holds = true;
      }
    }
    // What rounding has left over belongs to the last.
    pass(rays[r], how, at, held, mass_of(held), no_end, running);
  }

  /// All middles and ends up to a mass, which lie in this segment.
  ORBITFUSE_HOST_DEVICE void pass(const DeviceRay& given, const SampleSpread& how, int at,
                                  const Segment& in, float own, float up_to,
                                  Running& running) const {
    const float shift =
        0.5f * (given.jitter - 0.5f);  // samples keep to the middle half of their stratum
    for (; running.passed < 2 * how.count; ++running.passed) {
      const int k = running.passed / 2;
      const bool middle = running.passed % 2 == 0;
      const float place = static_cast<float>(k) + (middle ? 0.5f + shift : 1.0f);
      const float mass = place * how.per_sample;
      if (mass > up_to) return;
      const float part = fminf(fmaxf((mass - running.mass) / fmaxf(own, 1e-12f), 0.0f), 1.0f);
      if (middle) {
        running.t = in.begin + part * in.length;
        continue;
      }
      const float behind = running.length + part * in.length;
      float x[3], contracted[3];
      for (int d = 0; d < 3; ++d) x[d] = given.ray.origin[d] + running.t * given.ray.direction[d];
      contract01(x, contracted);
      put(at + k, running.t, fmaxf(0.0f, behind - running.edge), contracted);
      running.edge = behind;
    }
  }

  ORBITFUSE_HOST_DEVICE void put(int at, float t, float dt, const float contracted[3]) const {
    const float inverse = 1.0f / (1.0f + t);
    samples.t[at] = t;
    samples.dt[at] = dt;
    samples.s[at] = t * inverse;
    samples.ds[at] = dt * inverse * inverse;
    for (int d = 0; d < 3; ++d) samples.position01(d, at) = contracted[d];
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
