// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field/network.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/numeric/random.hpp"
#include "core/system/memory.hpp"

namespace orbitfuse::nerf {
namespace {

std::uint16_t bf16_of(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  return static_cast<std::uint16_t>((bits + 0x7FFFu + ((bits >> 16) & 1u)) >> 16);
}

std::uint16_t half_of(float value) {
  return std::bit_cast<std::uint16_t>(cv::float16_t(std::clamp(value, -max_half, max_half)));
}

}  // namespace

void Parameters::resize(std::size_t count) {
  for (std::vector<float>* numbers : {&value, &first, &second, &grad}) numbers->assign(count, 0);
}

std::int64_t HashEncoding::lay_out(int level_count, int features_per_level, int log2_table,
                                   int base_resolution, int max_resolution) {
  features = features_per_level;
  width = (level_count * features + 15) / 16 * 16;
  levels.clear();
  const double growth =
      level_count > 1
          ? std::pow(static_cast<double>(max_resolution) / base_resolution, 1.0 / (level_count - 1))
          : 1.0;
  std::int64_t offset = 0;
  for (int l = 0; l < level_count; ++l) {
    GridLevel level;
    level.features = features;
    level.resolution = static_cast<int>(std::lround(base_resolution * std::pow(growth, l)));
    const std::int64_t nodes = static_cast<std::int64_t>(level.resolution + 1) *
                               (level.resolution + 1) * (level.resolution + 1);
    const std::int64_t limit = std::int64_t{1} << log2_table;
    level.dense = nodes <= limit;
    level.entries = static_cast<std::uint32_t>(level.dense ? (nodes + 7) / 8 * 8 : limit);
    level.mask = level.entries - 1;
    level.offset = offset;
    offset += static_cast<std::int64_t>(level.entries) * features;
    levels.push_back(level);
  }
  return offset;
}

void HashEncoding::create(int level_count, int features_per_level, int log2_table,
                          int base_resolution, int max_resolution, std::uint64_t seed) {
  lay_out(level_count, features_per_level, log2_table, base_resolution, max_resolution);
  table.resize(levels);
  for (std::size_t i = 0; i < table.size(); ++i)
    table.value(i) = 2e-4f * (random_uniform(seed, 11, i) - 0.5f);
  level_weight.assign(levels.size(), 1.0f);
  refresh_half();
}

void HashEncoding::refresh_half() {
  reserve_huge(half, table.size());
  half.resize(table.size());
  for (std::size_t i = 0; i < half.size(); ++i) half[i] = half_of(table.value(i));
}

void HashEncoding::encode(const Kernels& kernels, const float* position01, int count,
                          float* out) const {
  const int used = static_cast<int>(levels.size()) * features;
  if (used < width)
    for (int s = 0; s < count; ++s)
      std::fill_n(out + static_cast<long>(s) * width + used, width - used, 0.0f);
  for (std::size_t l = 0; l < levels.size(); ++l) {
    float* column = out + static_cast<int>(l) * features;
    const float weight = level_weight[l];
    if (weight > 0)
      kernels.encode(levels[l], half.data() + levels[l].offset, position01, count, column, width);
    if (weight < 1)
      for (int s = 0; s < count; ++s)
        for (int f = 0; f < features; ++f) {
          float& v = column[static_cast<long>(s) * width + f];
          v = weight > 0 ? v * weight : 0.0f;
        }
  }
}

bool all_finite(const float* values, std::size_t count) {
  float sum = 0;  // x * 0 is NaN exactly for the values that must not pass
  for (std::size_t i = 0; i < count; ++i) sum += values[i] * 0.0f;
  return sum == 0.0f;
}

void by_level(const HashEncoding& grid, const std::vector<float>& rows, std::size_t count,
              std::vector<float>& levels) {
  const auto features = static_cast<std::size_t>(grid.features),
             width = static_cast<std::size_t>(grid.width);
  const std::size_t need = grid.levels.size() * count * features;
  if (levels.size() < need) levels.resize(need + need / 4);
  for (std::size_t l = 0; l < grid.levels.size(); ++l) {
    const float scale = grid.level_weight[l];
    float* out = &levels[l * count * features];
    const float* in = &rows[l * features];
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t f = 0; f < features; ++f) out[i * features + f] = scale * in[i * width + f];
  }
}

void Mlp::create(const std::vector<int>& widths, std::uint64_t seed) {
  layers.clear();
  std::int64_t offset = 0;
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    layers.push_back({widths[i], widths[i + 1], offset});
    offset += static_cast<std::int64_t>(widths[i]) * widths[i + 1];
  }
  weights.resize(static_cast<std::size_t>(offset));
  for (const Layer& layer : layers) {
    const float bound = std::sqrt(6.0f / static_cast<float>(layer.in + layer.out));
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(layer.in) * layer.out; ++i)
      weights.value[static_cast<std::size_t>(layer.offset + i)] =
          bound * (2 * random_uniform(seed, 12, static_cast<std::uint64_t>(layer.offset + i)) - 1);
  }
  refresh();
}

void Mlp::refresh() {
  transposed.resize(weights.size());
  paired.resize(weights.size());
  paired_t.resize(weights.size());
  for (const Layer& layer : layers) {
    const float* w = weights.value.data() + layer.offset;
    float* t = transposed.data() + layer.offset;
    std::uint16_t *p = paired.data() + layer.offset, *q = paired_t.data() + layer.offset;
    for (int i = 0; i < layer.in; ++i)
      for (int o = 0; o < layer.out; ++o) {
        const float value = w[i * layer.out + o];
        t[o * layer.in + i] = value;
        p[(i / 2) * layer.out * 2 + o * 2 + i % 2] = bf16_of(value);
        q[(o / 2) * layer.in * 2 + i * 2 + o % 2] = bf16_of(value);
      }
  }
}

LayerView Mlp::view(int index) const {
  const Layer& layer = layers[static_cast<std::size_t>(index)];
  return {layer.in,
          layer.out,
          weights.value.data() + layer.offset,
          transposed.data() + layer.offset,
          paired.data() + layer.offset,
          paired_t.data() + layer.offset};
}

void Mlp::forward(const Kernels& kernels, int rows, const float* in, Activations& a,
                  int first_row) const {
  a.resize(layers.size());
  const float* from = in;
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const auto out = static_cast<std::size_t>(layers[l].out);
    const std::size_t offset = static_cast<std::size_t>(first_row) * out;
    const std::size_t need = offset + static_cast<std::size_t>(rows) * out;
    if (a[l].size() < need) a[l].resize(need + need / 4);
    kernels.forward(view(static_cast<int>(l)), rows, from, a[l].data() + offset,
                    l + 1 < layers.size());
    from = a[l].data() + offset;
  }
}

void Mlp::backward(const Kernels& kernels, int rows, const float* in, const Activations& a,
                   const float* dout, float* din, std::vector<float>& scratch_a,
                   std::vector<float>& scratch_b, float* dweights) const {
  const float* d = dout;
  std::vector<float>*next = &scratch_a, *other = &scratch_b;
  for (int l = static_cast<int>(layers.size()) - 1; l >= 0; --l) {
    const LayerView layer = view(l);
    const float* input = l > 0 ? a[static_cast<std::size_t>(l - 1)].data() : in;
    kernels.backward_weights(layer, rows, input, d,
                             dweights + layers[static_cast<std::size_t>(l)].offset);
    if (l == 0) {
      if (din) kernels.backward_input(layer, rows, d, din, nullptr);
      return;
    }
    const std::size_t need = static_cast<std::size_t>(rows) * static_cast<std::size_t>(layer.in);
    if (next->size() < need) next->resize(need);
    kernels.backward_input(layer, rows, d, next->data(), input);
    d = next->data();
    std::swap(next, other);
  }
}

}  // namespace orbitfuse::nerf
