// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "recon/nerf/field/grid_table.hpp"
#include "recon/nerf/kernels/kernels.hpp"

namespace orbitfuse::nerf {

/// A perceptron's or few trainable numbers with their Adam moments and gradient.
struct Parameters {
  std::vector<float> value, first, second, grad;
  void resize(std::size_t count);
  std::size_t size() const { return value.size(); }
  const std::vector<float>& values() const { return value; }
  void set_values(const std::vector<float>& values) { value = values; }
};

/// Multiresolution hash encoding (Müller et al. 2022): `levels` resolutions growing geometrically,
/// features concatenated level by level and padded with zeros to a multiple of 16.
struct HashEncoding {
  std::vector<GridLevel> levels;
  int features = 0, width = 0;  ///< features per level; padded row width
  GridTable table;
  std::vector<std::uint16_t> half;  ///< what the kernels read
  std::vector<float> level_weight;  ///< coarse-to-fine: 0..1 per level

  /// The levels alone; returns the length of their table.
  std::int64_t lay_out(int level_count, int features_per_level, int log2_table, int base_resolution,
                       int max_resolution);
  void create(int level_count, int features_per_level, int log2_table, int base_resolution,
              int max_resolution, std::uint64_t seed);
  void refresh_half();
  void encode(const Kernels& kernels, const float* position01, int count, float* out) const;
};

/// Gradients of encoded rows, [row][width], as scatter() reads them: [level][row][feature].
void by_level(const HashEncoding& grid, const std::vector<float>& rows, std::size_t count,
              std::vector<float>& levels);

bool all_finite(const float* values, std::size_t count);

/// A perceptron without biases: ReLU between layers, linear output.
struct Mlp {
  struct Layer {
    int in = 0, out = 0;
    std::int64_t offset = 0;
  };
  std::vector<Layer> layers;
  Parameters weights;
  std::vector<float> transposed;
  std::vector<std::uint16_t> paired, paired_t;

  /// widths: {in, hidden..., out}, multiples of 16.
  void create(const std::vector<int>& widths, std::uint64_t seed);
  void refresh();  ///< rebuilds the kernels' layouts from `weights`
  LayerView view(int layer) const;
  int in() const { return layers.front().in; }
  int out() const { return layers.back().out; }

  /// Activations of one batch: the output of every layer, [rows][out] each.
  using Activations = std::vector<std::vector<float>>;
  /// Rows before `first_row` of `a` stay as they are: a batch may be computed in parts.
  void forward(const Kernels& kernels, int rows, const float* in, Activations& a,
               int first_row = 0) const;
  /// dout is [rows][out()]; din (may be null) gets dL/din; gradient is added to dweights.
  void backward(const Kernels& kernels, int rows, const float* in, const Activations& a,
                const float* dout, float* din, std::vector<float>& scratch_a,
                std::vector<float>& scratch_b, float* dweights) const;
};

}  // namespace orbitfuse::nerf
