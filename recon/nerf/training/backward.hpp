// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "recon/nerf/rendering/ray_block.hpp"

namespace orbitfuse::nerf {

/// What a ray should show.
struct RayTarget {
  float value[3] = {0, 0, 0};
  int view = 0, x = 0, y = 0;  ///< where it comes from
  float distance = 0;          ///< known distance along the ray (normalised), 0 = unknown
  float depth_weight = 0;      ///< of the depth loss on this ray
};

struct LossSettings {
  float per_ray = 1;  ///< 1 / rays of the step
  float distortion_weight = 0;
  float huber = 0;  ///< errors beyond it count linearly; 0 = squared error
};

/// Sums over a block; gradients are added, losses are means once divided by the rays.
struct BlockGradients {
  std::vector<float> mlp, color, offsets;
  std::array<std::vector<float>, 2> proposals;  ///< of their perceptrons
  double squared_error = 0, distortion = 0, depth = 0, interlevel = 0;
  long channels = 0;
  bool finite = true;  ///< the encoded features' gradients
  bool all_parts_finite() const;
  void reset(const FieldState& field);
  void add(const BlockGradients& other);
};

/// Gradients of the loss for a block that forward() has filled. `grid` receives the gradient of
/// the encoded features, level after level, [level][sample][feature].
void backward(const FieldState& field, const Kernels& kernels, const LossSettings& settings,
              const std::vector<RayTarget>& targets, RayBlock& block, BlockGradients& gradients,
              std::vector<float>& grid);

}  // namespace orbitfuse::nerf
