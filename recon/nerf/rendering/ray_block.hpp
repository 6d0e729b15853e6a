// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/nerf/field/field_state.hpp"
#include "recon/nerf/rendering/march.hpp"

namespace orbitfuse::nerf {

/// A few rays and everything computed along them. The last sample of each ray is the background:
/// the point at infinity in the ray's direction, opaque.
struct RayBlock {
  std::vector<Ray> rays;
  std::vector<int> first;  ///< first[r]..first[r+1]: samples of ray r
  std::vector<float> t, dt, position, position01;

  std::vector<float> features;
  Mlp::Activations density, color;
  std::vector<float> sigma, weight, light;  ///< light: transmittance after the sample
  std::vector<int> used;                    ///< per ray: samples before it went dark
  std::vector<int> active;                  ///< samples that got a colour
  std::vector<float> color_in;
  std::vector<float> value;  ///< [active][channels], activated

  // Scratch of the density pass: samples in the order of evaluation.
  std::vector<int> row_of, next, round;
  std::vector<char> background_known;  ///< per ray: light reached it, so it was evaluated
  std::vector<float> round_position01, round_features, ray_light;
  Mlp::Activations round_density;

  // Scratch of the backward pass.
  std::vector<float> dweight, dsigma, dcolor, dcolor_in, ddensity, dfeatures, scratch_a, scratch_b;
  std::vector<float> s, ds;

  int samples() const { return first.empty() ? 0 : first.back(); }
  void clear();
  /// Adds rays and their samples (occupancy marching).
  void add(const Occupancy& occupancy, const MarchSettings& settings,
           const std::vector<DrawnRay>& marched);
  /// Adds a ray with given samples.
  void add(const Ray& ray, const float* t_mid, const float* dt_in, int count);
};

struct ForwardSettings {
  float stop = training_stop;              ///< transmittance below which a ray is finished
  float min_weight = training_min_weight;  ///< samples that contribute less get no colour
  bool gradients = true;                   ///< keep what backward() reads
  float surface_light = 0.5f;              ///< TracedRay::distance: where so much light is left
};

/// Density, weights and colours of a block. Rays are followed front to back; samples behind what
/// stops them are removed from the block.
void forward(const FieldState& field, const Kernels& kernels, const ForwardSettings& settings,
             RayBlock& block);

/// Sum of weight * value over a ray; `out` has field.channels() values. `active_begin` walks
/// through block.active from ray to ray.
void ray_value(const FieldState& field, const RayBlock& block, int ray, int& active_begin,
               float* out);

/// Density at normalised positions (occupancy probes, tests).
void densities(const DensityNetwork& network, const Kernels& kernels, const float* position,
               int count, float* sigma);

}  // namespace orbitfuse::nerf
