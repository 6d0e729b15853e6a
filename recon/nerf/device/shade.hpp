// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/engine.hpp"
#include "recon/nerf/device/march.hpp"
#include "recon/nerf/field/network_shape.hpp"
#include "recon/nerf/kernels/compositing.hpp"
#include "recon/nerf/kernels/spherical_harmonics.hpp"

// From densities to what rays show, as forward() and ray_value() of ray_block.hpp. All samples have
// a density here: what lies behind the one that stops a ray costs less than finding out.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

/// Along the rays, and of each ray.
struct Light {
  float *sigma, *weight, *left;  ///< left: transmittance after the sample
  int* used;                     ///< per ray: samples before it went dark
  int* colored;                  ///< per ray: samples that get a colour, the background among them
};

struct Composite {
  const DeviceRay* rays;
  RaySamples samples;
  Rows density;
  float stop, min_weight;
  Light light;

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    light.colored[r] = light.used[r] = 0;
    if (!rays[r].there) return;
    const int begin = samples.first[r], end = samples.first[r + 1] - 1;  // end: the background
    for (int i = begin; i < end; ++i) light.sigma[i] = density_of(density(0, i));
    const int used = composite(end - begin, light.sigma + begin, samples.dt + begin, stop,
                               light.weight + begin, light.left + begin);
    int colored = 0;
    for (int i = begin; i < begin + used; ++i) colored += light.weight[i] >= min_weight;
    light.weight[end] = used > 0 ? light.left[begin + used - 1] : 1.0f;
    light.used[r] = used;
    light.colored[r] = colored + (light.weight[end] >= min_weight);
  }
};

struct ListColored {
  const DeviceRay* rays;
  RaySamples samples;
  Light light;
  float min_weight;
  const int* first_row;
  int *sample_of, *ray_of;  ///< of each row

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    if (!rays[r].there) return;
    const int begin = samples.first[r], end = samples.first[r + 1] - 1;
    int row = first_row[r];
    const auto list = [&](int sample) {
      if (light.weight[sample] < min_weight) return;
      sample_of[row] = sample;
      ray_of[row++] = r;
    };
    for (int i = begin; i < begin + light.used[r]; ++i) list(i);
    list(end);
  }
};

struct ColorInput {
  const DeviceRay* rays;
  Rows density;
  const int *sample_of, *ray_of, *counted;
  int sh_degree;
  Rows in;  ///< color_inputs

  ORBITFUSE_HOST_DEVICE void operator()(int row) const {
    if (row >= *counted) return;
    for (int k = 0; k < density_outputs; ++k) in(k, row) = density(k, sample_of[row]);
    float harmonics[max_sh];
    spherical_harmonics(sh_degree, rays[ray_of[row]].ray.direction, harmonics);
    for (int k = 0; k < max_sh; ++k) in(density_outputs + k, row) = harmonics[k];
  }
};

/// What a colour network's output means.
struct Shade {
  int channels;
  bool bounded;  ///< colours are; temperatures are not: beyond the span there may be a hotter spot
  ORBITFUSE_HOST_DEVICE float value(float raw) const {
    return bounded ? 1.0f / (1.0f + expf(-raw)) : 0.5f + raw;
  }
  ORBITFUSE_HOST_DEVICE float slope(float value) const {
    return bounded ? value * (1 - value) : 1.0f;
  }
};

/// Rays that a field has been asked about.
struct ShownRays {
  const DeviceRay* rays;
  RaySamples samples;
  Light light;
  Rows color;
  Shade shade;
  const int *first_row, *sample_of;

  /// Sum of weight * value over a ray's coloured samples.
  ORBITFUSE_HOST_DEVICE void value(int r, float out[3]) const {
    for (int c = 0; c < 3; ++c) out[c] = 0;
    for (int row = first_row[r]; row < first_row[r + 1]; ++row)
      for (int c = 0; c < shade.channels; ++c)
        out[c] += light.weight[sample_of[row]] * shade.value(color(c, row));
  }
};

/// As ImageRenderer writes a ray.
struct ReadRays {
  ShownRays shown;
  float stop, surface_light, no_distance;
  TracedRay* out;

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    const DeviceRay& given = shown.rays[r];
    TracedRay& ray = out[r];
    ray = {{0, 0, 0}, no_distance, 0, 0, no_end, given.ray.forward, false, given.there};
    if (!ray.there) return;
    shown.value(r, ray.value);
    const int begin = shown.samples.first[r];
    read_light(shown.light.used[r], shown.samples.t + begin, shown.samples.dt + begin,
               shown.light.left + begin, stop, surface_light, ray);
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
