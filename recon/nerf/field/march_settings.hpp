// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::nerf {

/// How many samples a ray gets: `surface` of them where surfaces are expected, and one per
/// occupied cell, up to `haze`, over everything that is not known to be empty.
struct MarchSettings {
  float near = 0.1f;  ///< normalised units
  int surface = 16;
  int haze = 24;
};

inline constexpr int max_ray_samples = 256;
inline constexpr int samples_per_round =
    8;  ///< of a ray, looked at before asking whether it goes on

/// What is left out of a picture that trains.
inline constexpr float training_stop = 1e-4f;        ///< transmittance that ends a ray
inline constexpr float training_min_weight = 1e-4f;  ///< samples that contribute less get no colour

}  // namespace orbitfuse::nerf
