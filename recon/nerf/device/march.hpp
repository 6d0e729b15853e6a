// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/rays.hpp"
#include "recon/nerf/field/contraction.hpp"
#include "recon/nerf/field/march_settings.hpp"
#include "recon/nerf/field/occupancy_codes.hpp"
#include "recon/nerf/field/traced_ray.hpp"

// Samples along rays on a device, as march() places them. A ray's next cell depends on its last,
// and a step's rays are few: each ray's way is walked in pieces, side by side, which note the
// occupied stretches; each ray shares out its samples among its pieces, and these place them.
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

/// What samples are shared out by: each stretch gets as many as its mass says.
ORBITFUSE_HOST_DEVICE inline float mass_of(const SampleSpread& how, float surface, float haze) {
  return surface * how.surface_share + haze * how.haze_share;
}

/// What a ray's piece holds, and what lies before it.
struct PieceSum {
  float surface, haze, length;
  float mass_before, length_before;
  float mass_end;  ///< samples up to it are this piece's
};

/// Occupied stretches of all rays' pieces: slot s of piece p of ray r is at [(p * slots + s) * rays
/// + r].
struct Stretches {
  int rays, slots;
  Segment* segment;
  int* count;     ///< [piece][ray]
  PieceSum* sum;  ///< [piece][ray]
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
    Segment held = {};
    PieceSum sum = {};
    const auto keep = [&] {
      found.at(piece, count - 1, r) = held;
      sum.length += held.length;
    };
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
        if (count > 0) keep();
        held = now;
        ++count;
      }
    }
    if (count > 0) keep();
    found.count[i] = count;
    found.sum[i] = sum;
  }
};

/// How many samples each ray gets, and which of them lie in which of its pieces.
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
    join_pieces(r);
    float surface = 0, haze = 0;
    for (int piece = 0; piece < ray_pieces; ++piece) {
      surface += sum(piece, r).surface;
      haze += sum(piece, r).haze;
    }
    if (!(haze > 0)) return;
    spread[r] = spread_of(surface, haze, settings);
    counts[r] = spread[r].count + 1;
    share_out(r, spread[r]);
  }

 private:
  ORBITFUSE_HOST_DEVICE PieceSum& sum(int piece, int r) const {
    return found.sum[piece * found.rays + r];
  }

  /// A stretch of which nothing is known may go on in the next pieces: it is its first piece's.
  ORBITFUSE_HOST_DEVICE void join_pieces(int r) const {
    int holder = -1;
    Segment held = {};
    for (int piece = 0; piece < ray_pieces; ++piece) {
      int& count = found.count[piece * found.rays + r];
      if (count == 0) continue;
      Segment& first = found.at(piece, 0, r);
      if (holder >= 0 && joined(held, first)) {
        found.at(holder, found.count[holder * found.rays + r] - 1, r) = held;
        sum(holder, r).haze += first.haze;
        sum(holder, r).length += first.length;
        if (count == 1) {
          count = 0;
          sum(piece, r) = {};
          continue;
        }
        sum(piece, r).haze -= first.haze;
        sum(piece, r).length -= first.length;
        first.haze = first.length = 0;
      }
      holder = piece;
      held = found.at(piece, count - 1, r);
    }
  }

  ORBITFUSE_HOST_DEVICE void share_out(int r, const SampleSpread& how) const {
    float mass = 0, length = 0;
    int last = 0;
    for (int piece = 0; piece < ray_pieces; ++piece) {
      PieceSum& own = sum(piece, r);
      own.mass_before = mass;
      own.length_before = length;
      mass += mass_of(how, own.surface, own.haze);
      length += own.length;
      own.mass_end = mass;
      if (found.count[piece * found.rays + r] > 0) last = piece;
    }
    sum(last, r).mass_end = no_end;  // what rounding has left over
  }
};

/// Samples of all rays, ray after ray; the last of each is the background: the point at infinity.
struct RaySamples {
  const int* first;        ///< of each ray, and behind the last
  float *t, *dt, *s, *ds;  ///< s = t / (1 + t), in which the distortion loss counts
  Rows position01;
};

/// Inverse transform sampling, of each piece's stretches for itself: where the running mass reaches
/// a sample's middle, and how much occupied length lies before its end.
struct PlaceSamples {
  const DeviceRay* rays;
  Stretches found;
  const SampleSpread* spread;
  RaySamples samples;  ///< t
  float* length_before_end;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const int r = i % found.rays, piece = i / found.rays, slots = found.count[i];
    const SampleSpread how = spread[r];
    if (slots == 0 || how.count == 0) return;
    const PieceSum sum = found.sum[i];
    // Samples keep to the middle half of their stratum.
    const float middle = 0.5f + 0.5f * (rays[r].jitter - 0.5f);
    const auto mass_at = [&](int mark) {  // middles and ends in turn
      return (static_cast<float>(mark / 2) + (mark % 2 == 0 ? middle : 1.0f)) * how.per_sample;
    };
    int mark = 2 * static_cast<int>(sum.mass_before / how.per_sample) - 2;
    if (mark < 0) mark = 0;
    while (mark < 2 * how.count && mass_at(mark) <= sum.mass_before) ++mark;

    const int at = samples.first[r];
    float mass = sum.mass_before, length = sum.length_before;
    Segment next = found.at(piece, 0, r);
    for (int slot = 0; slot < slots && mark < 2 * how.count; ++slot) {
      const Segment now = next;
      if (slot + 1 < slots) next = found.at(piece, slot + 1, r);  // on its way meanwhile
      const float own = mass_of(how, now.surface, now.haze);
      const float end = slot + 1 < slots ? fminf(mass + own, sum.mass_end) : sum.mass_end;
      for (; mark < 2 * how.count; ++mark) {
        const float wanted = mass_at(mark);
        if (wanted > end) break;
        const float part = fminf(fmaxf((wanted - mass) / fmaxf(own, 1e-12f), 0.0f), 1.0f);
        if (mark % 2 == 0)
          samples.t[at + mark / 2] = now.begin + part * now.length;
        else
          length_before_end[at + mark / 2] = length + part * now.length;
      }
      mass += own;
      length += now.length;
    }
  }
};

/// What else follows from where a sample lies; sample k of ray r is i = r * per_ray + k.
struct FinishSamples {
  const DeviceRay* rays;
  const SampleSpread* spread;
  const float* length_before_end;
  int per_ray;
  RaySamples samples;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const int r = i / per_ray, k = i % per_ray;
    if (!rays[r].there || k > spread[r].count) return;
    const Ray& ray = rays[r].ray;
    const int at = samples.first[r] + k;
    if (k == spread[r].count) {
      const float infinity[3] = {0.5f + 0.5f * ray.direction[0], 0.5f + 0.5f * ray.direction[1],
                                 0.5f + 0.5f * ray.direction[2]};
      put(at, 1e6f, 0, infinity);
      return;
    }
    const float t = samples.t[at], before = k > 0 ? length_before_end[at - 1] : 0.0f;
    float x[3], contracted[3];
    for (int d = 0; d < 3; ++d) x[d] = ray.origin[d] + t * ray.direction[d];
    contract01(x, contracted);
    put(at, t, fmaxf(0.0f, length_before_end[at] - before), contracted);
  }

 private:
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
