// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

/// How many samples a ray gets: `surface` of them where surfaces are expected, and one per
/// occupied cell, up to `haze`, over everything that is not known to be empty.
struct MarchSettings {
  float near = 0.1f;  ///< normalised units
  int surface = 16;
  int haze = 24;
};

inline constexpr int max_ray_samples = 256;

/// How a ray's samples are shared out among the occupied stretches along it: each has as many as
/// its surface and its haze get, `per_sample` of that makes one.
struct SampleSpread {
  int count;
  float surface_share, haze_share, per_sample;
};
/// From the sums over the stretches; `haze` is above 0 where there are any.
ORBITFUSE_HOST_DEVICE inline SampleSpread spread_of(float surface, float haze,
                                                    const MarchSettings& settings) {
  constexpr float least_haze = 2;
  const auto asked = static_cast<float>(settings.haze);
  const float most_haze = asked > least_haze ? asked : least_haze;
  const float for_surface = static_cast<float>(settings.surface) * (surface < 1 ? surface : 1.0f);
  const float for_haze = haze < least_haze ? least_haze : haze > most_haze ? most_haze : haze;
  const int wanted = static_cast<int>(std::ceil(for_surface + for_haze));
  const int count = wanted < max_ray_samples ? wanted : max_ray_samples;
  return {count, surface > 0 ? for_surface / surface : 0.0f, for_haze / haze,
          (for_surface + for_haze) / static_cast<float>(count)};
}

inline constexpr int samples_per_round =
    8;  ///< of a ray, looked at before asking whether it goes on

/// What is left out of a picture that trains.
inline constexpr float training_stop = 1e-4f;        ///< transmittance that ends a ray
inline constexpr float training_min_weight = 1e-4f;  ///< samples that contribute less get no colour

}  // namespace orbitfuse::nerf
