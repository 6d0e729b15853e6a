// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "recon/nerf/rendering/ray_block.hpp"

namespace orbitfuse::nerf {

/// Two small density networks that say where a ray's fine samples should be (Mip-NeRF 360, as in
/// nerfacto): what they were asked for a block of rays, and what backward_proposals() needs.
struct ProposalBlock {
  struct Level {
    int bins = 0;               ///< per ray
    std::vector<float> spaced;  ///< [ray][bins + 1] edges, spaced_of(distance) between near and far
    std::vector<float> edge;    ///< the same as distances
    std::vector<float> dt, position01, features, sigma, weight, light;
    Mlp::Activations density;
    std::vector<float> dweight, ddensity, dfeatures;
    std::vector<float> grid;  ///< gradient of the encoded features, [level][sample][feature]
  };
  std::array<Level, 2> levels;
  std::vector<float> fine_edge, low, high, slope, scratch_a, scratch_b;

  int samples(int level) const {
    return static_cast<int>(levels[static_cast<std::size_t>(level)].dt.size());
  }
};

struct ProposalSettings {
  float near = 0.1f, far = 1000.0f;  ///< normalised units
  /// Exponent of the weights: early proposals know little, so they are flattened (0 = even).
  float anneal = 1;
};

/// Adds `rays` with field.options.fine_samples samples each to `block`.
void add_proposed(const FieldState& field, const Kernels& kernels,
                  const std::vector<DrawnRay>& rays, const ProposalSettings& settings,
                  ProposalBlock& proposals, RayBlock& block);

/// Gradients of the interlevel loss for a block that add_proposed() and forward() have filled:
/// added to dweights[level], the grids' into proposals. Returns the loss, NaN if a gradient is not
/// finite.
/// The fine weights are constants here: the field doesn't learn from its proposals.
double backward_proposals(const FieldState& field, const Kernels& kernels, const RayBlock& block,
                          float per_ray, ProposalBlock& proposals,
                          std::array<std::vector<float>, 2>& dweights);

}  // namespace orbitfuse::nerf
