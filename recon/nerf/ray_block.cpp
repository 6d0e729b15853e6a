// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/ray_block.hpp"

#include <algorithm>
#include <cmath>

#include "recon/nerf/compositing.hpp"
#include "recon/nerf/spherical_harmonics.hpp"

namespace orbitfuse::nerf {
namespace {

/// The neutral element of growth-only buffers: contents are overwritten before they are read.
void reserve_floats(std::vector<float>& buffer, std::size_t count) {
  if (buffer.size() < count) buffer.resize(count + count / 4);
}

}  // namespace

float density_of(float log_density) {
  return std::exp(std::clamp(log_density + log_density_bias, -20.0f, max_log_density));
}

void RayBlock::clear() {
  rays.clear();
  first.assign(1, 0);
  t.clear();
  dt.clear();
  position.clear();
  position01.clear();
}

void RayBlock::add(const Ray& ray, const float* t_mid, const float* dt_in, int count) {
  rays.push_back(ray);
  for (int i = 0; i < count; ++i) {
    float x[3], c[3];
    for (int d = 0; d < 3; ++d) x[d] = ray.origin[d] + t_mid[i] * ray.direction[d];
    contract01(x, c);
    position.insert(position.end(), x, x + 3);
    position01.insert(position01.end(), c, c + 3);
  }
  t.insert(t.end(), t_mid, t_mid + count);
  dt.insert(dt.end(), dt_in, dt_in + count);
  // Infinity lies on the contracted ball's surface.
  for (int d = 0; d < 3; ++d) {
    position.push_back(1e6f * ray.direction[d]);
    position01.push_back(0.5f + 0.5f * ray.direction[d]);
  }
  t.push_back(1e6f);
  dt.push_back(0);
  first.push_back(static_cast<int>(t.size()));
}

void RayBlock::add(const FieldState& field, const Ray& ray, const MarchSettings& settings,
                   float jitter) {
  thread_local std::vector<float> t_mid, length;
  t_mid.resize(max_ray_samples);
  length.resize(max_ray_samples);
  const int count = march(field.occupancy, ray, settings, jitter, t_mid.data(), length.data());
  add(ray, t_mid.data(), length.data(), count);
}

void forward(const FieldState& field, const Kernels& kernels, const ForwardSettings& settings,
             RayBlock& b) {
  const int n = b.samples();
  const auto count = static_cast<std::size_t>(n);
  const auto width = static_cast<std::size_t>(field.main.grid.width);
  reserve_floats(b.features, count * width);
  reserve_floats(b.sigma, count);
  reserve_floats(b.weight, count);
  reserve_floats(b.light, count);
  b.used.resize(b.rays.size());
  b.active.clear();

  field.main.grid.encode(kernels, b.position01.data(), n, b.features.data());
  field.main.mlp.forward(kernels, n, b.features.data(), b.density);
  const float* out = b.density.back().data();
  for (int i = 0; i < n; ++i) b.sigma[static_cast<std::size_t>(i)] = density_of(out[i * density_outputs]);

  for (std::size_t r = 0; r < b.rays.size(); ++r) {
    const int begin = b.first[r], end = b.first[r + 1] - 1;  // end: the background
    const int used = composite(end - begin, &b.sigma[static_cast<std::size_t>(begin)],
                               &b.dt[static_cast<std::size_t>(begin)], settings.stop,
                               &b.weight[static_cast<std::size_t>(begin)],
                               &b.light[static_cast<std::size_t>(begin)]);
    b.used[r] = used;
    for (int i = begin; i < begin + used; ++i)
      if (b.weight[static_cast<std::size_t>(i)] >= settings.min_weight) b.active.push_back(i);
    const float left = used > 0 ? b.light[static_cast<std::size_t>(begin + used - 1)] : 1.0f;
    b.weight[static_cast<std::size_t>(end)] = left;
    if (left >= settings.min_weight) b.active.push_back(end);
  }

  const std::size_t rows = b.active.size();
  reserve_floats(b.color_in, rows * color_inputs);
  std::size_t row = 0;
  for (std::size_t r = 0; r < b.rays.size(); ++r) {
    float harmonics[max_sh];
    spherical_harmonics(field.options.sh_degree, b.rays[r].direction, harmonics);
    for (; row < rows && b.active[row] < b.first[r + 1]; ++row) {
      float* in = &b.color_in[row * color_inputs];
      std::copy_n(out + b.active[row] * density_outputs, density_outputs, in);
      std::copy_n(harmonics, max_sh, in + density_outputs);
    }
  }
  field.color.forward(kernels, static_cast<int>(rows), b.color_in.data(), b.color);
  const auto channels = static_cast<std::size_t>(field.channels());
  reserve_floats(b.value, rows * channels);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t c = 0; c < channels; ++c) {
      const float raw = b.color.back()[i * color_outputs + c];
      // Colours are bounded; temperatures are not: beyond the span there may be a hotter spot.
      b.value[i * channels + c] =
          field.modality == Modality::visible ? 1.0f / (1.0f + std::exp(-raw)) : 0.5f + raw;
    }
}

void ray_value(const FieldState& field, const RayBlock& b, int ray, int& row, float* out) {
  const int channels = field.channels();
  std::fill_n(out, channels, 0.0f);
  const int end = b.first[static_cast<std::size_t>(ray) + 1];
  for (; row < static_cast<int>(b.active.size()) && b.active[static_cast<std::size_t>(row)] < end; ++row) {
    const float w = b.weight[static_cast<std::size_t>(b.active[static_cast<std::size_t>(row)])];
    for (int c = 0; c < channels; ++c) out[c] += w * b.value[static_cast<std::size_t>(row * channels + c)];
  }
}

void densities(const DensityNetwork& network, const Kernels& kernels, const float* position,
               int count, float* sigma) {
  thread_local std::vector<float> features, contracted;
  thread_local Mlp::Activations activations;
  reserve_floats(features, static_cast<std::size_t>(count) * static_cast<std::size_t>(network.grid.width));
  reserve_floats(contracted, static_cast<std::size_t>(count) * 3);
  for (int i = 0; i < count; ++i) contract01(position + 3 * i, &contracted[static_cast<std::size_t>(3 * i)]);
  network.grid.encode(kernels, contracted.data(), count, features.data());
  network.mlp.forward(kernels, count, features.data(), activations);
  for (int i = 0; i < count; ++i)
    sigma[i] = density_of(activations.back()[static_cast<std::size_t>(i * density_outputs)]);
}

}  // namespace orbitfuse::nerf
