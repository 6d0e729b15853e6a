// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/numeric/random.hpp"
#include "recon/nerf/device/launch.hpp"
#include "recon/nerf/field/draw_rules.hpp"
#include "recon/nerf/field/ray.hpp"
#include "recon/nerf/field/ray_numbers.hpp"
#include "recon/nerf/field/traced_ray.hpp"

// A step's rays, drawn on the device as Trainer::draw() draws them.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// A view that trains: where its parts begin in the arrays of all.
struct TrainingPhoto {
  RayNumbers rays;
  long lattice, pixel, known, clearance;  ///< clearance -1: no plain background
};

/// All views' pixels.
struct Photos {
  const TrainingPhoto* view;
  const float* lattice;           ///< pairs
  const float* target;            ///< [pixel][channels]
  const float* distance;          ///< NaN: unknown
  const std::int32_t* known;      ///< pixels whose distance is known
  const std::uint8_t* clearance;  ///< px to the object
  int channels;
};

/// In camera axes, z = 1; as ViewRays::through().
ORBITFUSE_HOST_DEVICE inline void through(const RayNumbers& rays, const float* lattice, double px,
                                          double py, double out[3]) {
  out[2] = 1;
  if (rays.lattice_columns == 0) {
    out[0] = (px - rays.cx) / rays.fx;
    out[1] = (py - rays.cy) / rays.fy;
    return;
  }
  const double p[2] = {px, py};
  const int nodes[2] = {rays.lattice_columns, rays.lattice_rows},
            size[2] = {rays.width, rays.height};
  int node[2];
  float part[2];
  for (int d = 0; d < 2; ++d) {
    const int wanted = static_cast<int>(p[d]) / lattice_px, last = nodes[d] - 2;
    node[d] = wanted < 0 ? 0 : wanted > last ? last : wanted;
    // The lattice's last step is as short as the picture leaves it.
    const int low = node[d] * lattice_px < size[d] ? node[d] * lattice_px : size[d];
    const int next = (node[d] + 1) * lattice_px, high = next < size[d] ? next : size[d];
    part[d] = high > low ? static_cast<float>((p[d] - low) / (high - low)) : 0.0f;
  }
  for (int d = 0; d < 2; ++d) {
    const auto at = [&](int y, int x) {
      return lattice[2 * ((node[1] + y) * rays.lattice_columns + node[0] + x) + d];
    };
    const float above = at(0, 0) + part[0] * (at(0, 1) - at(0, 0)),
                below = at(1, 0) + part[0] * (at(1, 1) - at(1, 0));
    out[d] = above + part[1] * (below - above);
  }
}

/// As ViewRays::ray().
ORBITFUSE_HOST_DEVICE inline bool ray_of(const RayNumbers& rays, const float* lattice, double x,
                                         double y, Ray& out) {
  double d[3];
  through(rays, lattice, x, y, d);
  const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  if (!(length - length == 0)) return false;
  out.forward = static_cast<float>(1 / length);
  for (int i = 0; i < 3; ++i) {
    const double* row = rays.world_from_cam[i];
    out.origin[i] = static_cast<float>(rays.origin[i]);
    out.direction[i] = static_cast<float>(row[0] * (d[0] / length) + row[1] * (d[1] / length) +
                                          row[2] * (d[2] / length));
  }
  return true;
}

/// A ray and, in training, what it should show.
struct DeviceRay {
  Ray ray;
  float near, far, jitter;
  bool there;  ///< false: none of the draws could be used
  int view, x, y;
  float value[3];
  float distance, depth_weight;  ///< KnownDistance
};

/// A ray through one pixel drawn from all that train.
struct DrawRays {
  Photos photos;
  const int* training;          ///< their indices
  const long long* known_ends;  ///< running count of their pixels with known distance
  int training_count;
  std::uint64_t seed;
  int step;
  std::uint64_t first_ray;
  PixelTilesView tiles;
  bool sparse;        ///< known distances are few points of SfM
  float supervision;  ///< weight of the depth loss
  DeviceRay* rays;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    DeviceRay& out = rays[i];
    out.there = false;
    const std::uint64_t ray = first_ray + static_cast<unsigned>(i);
    for (int attempt = 0; attempt < draw_attempts && !out.there; ++attempt) {
      const std::uint64_t key = draw_key(step, i, attempt);
      const std::uint64_t bits = random_bits(seed, pixel_stream, key);
      const bool at_known = sparse && supervision > 0 && i % known_every == 0;
      const DrawnPixel drawn =
          at_known ? known_pixel(bits) : pixel_at(tiles, pixel_bits(seed, ray, attempt, bits));
      const TrainingPhoto& view = photos.view[drawn.view];
      out.view = drawn.view;
      out.x = drawn.x;
      out.y = drawn.y;
      const long long pixel = static_cast<long long>(drawn.y) * view.rays.width + drawn.x;
      out.there = usable(view, pixel, bits, out);
    }
    out.jitter = ray_jitter(seed, ray);
  }

 private:
  ORBITFUSE_HOST_DEVICE DrawnPixel known_pixel(std::uint64_t bits) const {
    const auto pick =
        static_cast<long long>(bits % static_cast<std::uint64_t>(known_ends[training_count - 1]));
    const int slot = first_beyond(known_ends, training_count, pick);
    const TrainingPhoto& view = photos.view[training[slot]];
    const int pixel = photos.known[view.known + pick - (slot > 0 ? known_ends[slot - 1] : 0)];
    return {training[slot], pixel % view.rays.width, pixel / view.rays.width};
  }

  ORBITFUSE_HOST_DEVICE bool usable(const TrainingPhoto& view, long long pixel, std::uint64_t bits,
                                    DeviceRay& out) const {
    const bool shows_nothing = view.clearance >= 0 && photos.clearance[view.clearance + pixel] >
                                                          background_rim_px(view.rays.width);
    if (shows_nothing && (bits >> 32) % background_every != 0) return false;
    const float* stored = photos.target + (view.pixel + pixel) * photos.channels;
    if (!is_finite(stored[0]) ||
        !ray_of(view.rays, photos.lattice + view.lattice, out.x + 0.5, out.y + 0.5, out.ray))
      return false;
    for (int c = 0; c < photos.channels; ++c) out.value[c] = stored[c];
    const float distance = photos.distance[view.pixel + pixel];
    const bool known = is_finite(distance);
    out.near = 0;
    // What lies behind a known surface isn't seen. Sparse points are too few to gain from it.
    out.far = known && !sparse ? distance * known_depth_margin : no_end;
    out.distance = known ? distance : 0.0f;
    out.depth_weight = known ? supervision : 0.0f;
    return true;
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
