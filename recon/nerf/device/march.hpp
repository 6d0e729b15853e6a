// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/rays.hpp"
#include "recon/nerf/field/contraction.hpp"
#include "recon/nerf/field/march_settings.hpp"

// Samples along rays on a device, as march() places them. A thread walks its ray twice, once to
// count and once to place: what lies along it would not fit into a thread's memory.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// Occupancy as marching reads it.
struct Cells {
  int resolution, cascades;
  const std::uint8_t* look;
  const std::uint64_t *any, *plain;
  const float* densities;  ///< of codes
};

constexpr int most_segments = 4096;  // a diagonal through all cascades of 256 cells needs 2300
constexpr int most_ray_samples = 256;

/// The stretch of a ray inside one occupied cell, or through cells of which nothing is known.
struct Segment {
  float begin, length, surface, haze;
  bool plain;
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

/// Occupied stretches of one ray, nearest first.
class CellWalk {
 public:
  ORBITFUSE_HOST_DEVICE CellWalk(const Cells& cells, const DeviceRay& given, float near)
      : cells_(cells), t_(near > given.near ? near : given.near), far_(given.far) {
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
    pending_there_ = stretch(pending_);
  }

  /// False: there is none left.
  ORBITFUSE_HOST_DEVICE bool next(Segment& out) {
    if (!pending_there_ || count_ == most_segments) return false;
    out = pending_;
    while ((pending_there_ = stretch(pending_))) {
      if (!(pending_.plain && out.plain && pending_.begin <= out.begin + out.length + 1e-5f)) break;
      out.length += pending_.length;
      out.haze += pending_.haze;
    }
    ++count_;
    return true;
  }

 private:
  /// Crosses blocks cell by cell, empty and plain ones in one step, up to the next that is on.
  ORBITFUSE_HOST_DEVICE bool stretch(Segment& out) {
    const float half = 0.5f * static_cast<float>(cells_.resolution);
    const int blocks = cells_.resolution / 4;
    for (; steps_ < 8 * most_segments; ++steps_) {
      float x[3];
      for (int d = 0; d < 3; ++d) x[d] = origin_[d] + t_ * direction_[d];
      const int cascade = cascade_of(x);
      if (!(t_ < far_) || cascade >= cells_.cascades) return false;
      const float doublings = static_cast<float>(1 << cascade);
      const float size = 2.0f * doublings / static_cast<float>(cells_.resolution),
                  scale = half / doublings;
      long block = cascade;
      int cell = 0;
      for (int d = 2; d >= 0; --d) {
        const int i = bounded(static_cast<int>(x[d] * scale + half), cells_.resolution - 1);
        block = block * blocks + (i >> 2);
        cell = cell << 2 | (i & 3);
      }
      const bool any = bit_of(cells_.any, block), by_cell = any && !bit_of(cells_.plain, block);
      const float begin = t_, length = way_out(x, by_cell ? size : 4 * size, size);
      t_ += length;
      if (!any) continue;
      const int look = cells_.look[block * 64 + cell];
      if (look == 0) continue;
      // depth / (1 + depth) stands for 1 - exp(-depth): only relative sizes matter here.
      const float depth = length * cells_.densities[look - 1];
      out = {begin, length, depth / (1 + depth), length / size, look == 1};
      ++steps_;
      return true;
    }
    return false;
  }

  ORBITFUSE_HOST_DEVICE float way_out(const float x[3], float step, float size) const {
    const float per_step = 1.0f / step;
    float exit = 3.402823466e38f;
    for (int d = 0; d < 3; ++d) {
      const float edge = (floorf(x[d] * per_step) + (inverse_[d] > 0 ? 1.0f : 0.0f)) * step;
      exit = fminf(exit, (edge - x[d]) * inverse_[d]);
    }
    return fmaxf(exit, 0.0f) + size * 1e-3f;  // across the border in spite of rounding
  }

  const Cells& cells_;
  float origin_[3], direction_[3], inverse_[3], t_, far_;
  Segment pending_;
  bool pending_there_;
  int count_ = 0, steps_ = 0;
};

/// How a ray's samples are spread.
struct Spread {
  int count;
  float surface_share, haze_share, per_sample;
};

struct CountSamples {
  Cells cells;
  MarchSettings settings;
  const DeviceRay* rays;
  Spread* spread;
  int* counts;  ///< with one for the background

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    spread[r].count = 0;
    counts[r] = 0;
    if (!rays[r].there) return;
    counts[r] = 1;
    float surface = 0, haze = 0;
    CellWalk walk(cells, rays[r], settings.near);
    Segment segment;
    bool any = false;
    while (walk.next(segment)) {
      surface += segment.surface;
      haze += segment.haze;
      any = true;
    }
    if (!any) return;
    const float most_haze = settings.haze > 2 ? static_cast<float>(settings.haze) : 2.0f;
    const float for_surface = static_cast<float>(settings.surface) * fminf(1.0f, surface);
    const float for_haze = fminf(fmaxf(haze, 2.0f), most_haze);
    const int wanted = static_cast<int>(ceilf(for_surface + for_haze));
    const int count = wanted < most_ray_samples ? wanted : most_ray_samples;
    spread[r] = {count, surface > 0 ? for_surface / surface : 0.0f, for_haze / haze,
                 (for_surface + for_haze) / static_cast<float>(count)};
    counts[r] = count + 1;
  }
};

/// Samples of all rays, ray after ray; the last of each is the background: the point at infinity.
struct Samples {
  const int* first;        ///< of each ray, and behind the last
  float *t, *dt, *s, *ds;  ///< s = t / (1 + t), in which the distortion loss counts
  Rows position01;
};

/// Inverse transform sampling of a ray's segments.
struct PlaceSamples {
  Cells cells;
  MarchSettings settings;
  const DeviceRay* rays;
  const Spread* spread;
  Samples samples;

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    const DeviceRay& given = rays[r];
    if (!given.there) return;
    const Spread& how = spread[r];
    int at = samples.first[r];
    if (how.count > 0) place(given, how, at);
    at += how.count;
    const float infinity[3] = {0.5f + 0.5f * given.ray.direction[0],
                               0.5f + 0.5f * given.ray.direction[1],
                               0.5f + 0.5f * given.ray.direction[2]};
    put(at, 1e6f, 0, infinity);
  }

 private:
  ORBITFUSE_HOST_DEVICE void place(const DeviceRay& given, const Spread& how, int at) const {
    CellWalk walk(cells, given, settings.near);
    Segment now, next;
    if (!walk.next(now)) return;
    bool more = walk.next(next);
    float mass_before = 0, length_before = 0, edge = 0;
    const auto mass_of = [&](const Segment& s) {
      return s.surface * how.surface_share + s.haze * how.haze_share;
    };
    const auto part_at = [&](float mass) {  // of the segment that holds this mass
      float own = mass_of(now);
      while (more && mass_before + own < mass) {
        mass_before += own;
        length_before += now.length;
        now = next;
        more = walk.next(next);
        own = mass_of(now);
      }
      return fminf(fmaxf((mass - mass_before) / fmaxf(own, 1e-12f), 0.0f), 1.0f);
    };
    const float shift =
        0.5f * (given.jitter - 0.5f);  // samples keep to the middle half of their stratum
    for (int k = 0; k < how.count; ++k) {
      const float middle = part_at((static_cast<float>(k) + 0.5f + shift) * how.per_sample);
      const float t = now.begin + middle * now.length;
      const float end = part_at(static_cast<float>(k + 1) * how.per_sample);
      const float behind = length_before + end * now.length;
      float x[3], contracted[3];
      for (int d = 0; d < 3; ++d) x[d] = given.ray.origin[d] + t * given.ray.direction[d];
      contract01(x, contracted);
      put(at + k, t, fmaxf(0.0f, behind - edge), contracted);
      edge = behind;
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
