// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/rendering/ray_block.hpp"

#include <algorithm>
#include <cmath>

#include "recon/nerf/kernels/compositing.hpp"
#include "recon/nerf/kernels/spherical_harmonics.hpp"

namespace orbitfuse::nerf {
namespace {

/// The neutral element of growth-only buffers: contents are overwritten before they are read.
void reserve_floats(std::vector<float>& buffer, std::size_t count) {
  if (buffer.size() < count) buffer.resize(count + count / 4);
}

}  // namespace

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

void RayBlock::add(const Occupancy& occupancy, const MarchSettings& settings,
                   const std::vector<DrawnRay>& marched) {
  thread_local std::vector<Marched> samples(march_lanes);
  const int count = static_cast<int>(marched.size());
  for (int begin = 0; begin < count; begin += march_lanes) {
    const int n = std::min(march_lanes, count - begin);
    march(occupancy, settings, &marched[static_cast<std::size_t>(begin)], n, samples.data());
    for (int i = 0; i < n; ++i) {
      const Marched& m = samples[static_cast<std::size_t>(i)];
      add(marched[static_cast<std::size_t>(begin + i)].ray, m.t, m.dt, m.count);
    }
  }
}

namespace {

/// Encodes and evaluates the samples in b.round behind the `done` evaluated before them.
void evaluate_round(const FieldState& field, const Kernels& kernels, RayBlock& b, int done) {
  const int count = static_cast<int>(b.round.size());
  const auto width = static_cast<std::size_t>(field.main.grid.width);
  const auto before = static_cast<std::size_t>(done), more = static_cast<std::size_t>(count);
  reserve_floats(b.round_position01, 3 * more);
  reserve_floats(b.round_features, (before + more) * width);
  for (std::size_t i = 0; i < more; ++i) {
    const auto sample = static_cast<std::size_t>(b.round[i]);
    std::copy_n(&b.position01[3 * sample], 3, &b.round_position01[3 * i]);
    b.row_of[sample] = done + static_cast<int>(i);
  }
  float* features = b.round_features.data() + before * width;
  field.main.grid.encode(kernels, b.round_position01.data(), count, features);
  field.main.mlp.forward(kernels, count, features, b.round_density, done);
}

/// Density of all samples that light reaches, a few per ray and round: b.row_of says where their
/// features and densities are, -1 for the others.
void evaluate_front_to_back(const FieldState& field, const Kernels& kernels,
                            const ForwardSettings& settings, RayBlock& b) {
  const std::size_t rays = b.rays.size();
  b.row_of.assign(b.t.size(), -1);
  b.next.assign(b.first.begin(), b.first.end() - 1);
  b.ray_light.assign(rays, 1.0f);
  int done = 0;
  for (bool background = false; !background;) {
    b.round.clear();
    for (std::size_t r = 0; r < rays; ++r) {
      if (b.ray_light[r] < settings.stop) continue;
      const int end = std::min(b.next[r] + samples_per_round, b.first[r + 1] - 1);
      for (int i = b.next[r]; i < end; ++i) b.round.push_back(i);
    }
    background = b.round.empty();
    if (background)
      for (std::size_t r = 0; r < rays; ++r)
        // Half: composite() rounds differently, and decides what is coloured.
        if (b.ray_light[r] >= 0.5f * settings.min_weight) b.round.push_back(b.first[r + 1] - 1);
    evaluate_round(field, kernels, b, done);
    const float* out = b.round_density.back().data();
    std::size_t at = 0;
    for (std::size_t r = 0; r < rays && !background; ++r) {
      float depth = 0;
      for (; at < b.round.size() && b.round[at] < b.first[r + 1]; ++at) {
        const auto row = static_cast<std::size_t>(done) + at;
        // As composite(): what lies behind the sample that stops the ray doesn't count.
        if (b.ray_light[r] * std::exp(-depth) >= settings.stop)
          depth +=
              density_of(out[row * density_outputs]) * b.dt[static_cast<std::size_t>(b.round[at])];
        b.next[r] = b.round[at] + 1;
      }
      b.ray_light[r] *= std::exp(-depth);
    }
    done += static_cast<int>(b.round.size());
  }
}

/// Keeps the evaluated samples and each ray's background, ray by ray. A background that no light
/// reaches has no features; it is never coloured.
void drop_unseen(const FieldState& field, const ForwardSettings& settings, RayBlock& b) {
  const auto width = static_cast<std::size_t>(field.main.grid.width);
  const std::size_t total = b.t.size();
  b.density.resize(b.round_density.size());
  if (settings.gradients) reserve_floats(b.features, total * width);
  for (std::size_t l = settings.gradients ? 0 : b.density.size() - 1; l < b.density.size(); ++l)
    reserve_floats(b.density[l], total * static_cast<std::size_t>(field.main.mlp.layers[l].out));
  b.background_known.assign(b.rays.size(), 0);
  std::size_t kept = 0;
  for (std::size_t r = 0; r < b.rays.size(); ++r) {
    const auto begin = static_cast<std::size_t>(b.first[r]),
               end = static_cast<std::size_t>(b.first[r + 1]);
    b.first[r] = static_cast<int>(kept);
    b.background_known[r] = b.row_of[end - 1] >= 0;
    for (std::size_t i = begin; i < end; ++i) {
      const int row = b.row_of[i];
      if (row < 0 && i + 1 < end) continue;
      const auto from = static_cast<std::size_t>(std::max(0, row));
      b.t[kept] = b.t[i];
      b.dt[kept] = b.dt[i];
      std::copy_n(&b.position[3 * i], 3, &b.position[3 * kept]);
      std::copy_n(&b.position01[3 * i], 3, &b.position01[3 * kept]);
      if (settings.gradients)
        std::copy_n(&b.round_features[from * width], width, &b.features[kept * width]);
      for (std::size_t l = settings.gradients ? 0 : b.density.size() - 1; l < b.density.size();
           ++l) {
        const auto out = static_cast<std::size_t>(field.main.mlp.layers[l].out);
        std::copy_n(&b.round_density[l][from * out], out, &b.density[l][kept * out]);
      }
      ++kept;
    }
  }
  b.first.back() = static_cast<int>(kept);
  b.t.resize(kept);
  b.dt.resize(kept);
  b.position.resize(3 * kept);
  b.position01.resize(3 * kept);
}

}  // namespace

void forward(const FieldState& field, const Kernels& kernels, const ForwardSettings& settings,
             RayBlock& b) {
  evaluate_front_to_back(field, kernels, settings, b);
  drop_unseen(field, settings, b);
  const int n = b.samples();
  const auto count = static_cast<std::size_t>(n);
  reserve_floats(b.sigma, count);
  reserve_floats(b.weight, count);
  reserve_floats(b.light, count);
  b.used.resize(b.rays.size());
  b.active.clear();
  const float* out = n > 0 ? b.density.back().data() : nullptr;
  for (int i = 0; i < n; ++i)
    b.sigma[static_cast<std::size_t>(i)] = density_of(out[i * density_outputs]);

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
    if (left >= settings.min_weight && b.background_known[r]) b.active.push_back(end);
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
  for (; row < static_cast<int>(b.active.size()) && b.active[static_cast<std::size_t>(row)] < end;
       ++row) {
    const float w = b.weight[static_cast<std::size_t>(b.active[static_cast<std::size_t>(row)])];
    for (int c = 0; c < channels; ++c)
      out[c] += w * b.value[static_cast<std::size_t>(row * channels + c)];
  }
}

void densities(const DensityNetwork& network, const Kernels& kernels, const float* position,
               int count, float* sigma) {
  thread_local std::vector<float> features, contracted;
  thread_local Mlp::Activations activations;
  reserve_floats(features,
                 static_cast<std::size_t>(count) * static_cast<std::size_t>(network.grid.width));
  reserve_floats(contracted, static_cast<std::size_t>(count) * 3);
  for (int i = 0; i < count; ++i)
    contract01(position + 3 * i, &contracted[static_cast<std::size_t>(3 * i)]);
  network.grid.encode(kernels, contracted.data(), count, features.data());
  network.mlp.forward(kernels, count, features.data(), activations);
  for (int i = 0; i < count; ++i)
    sigma[i] = density_of(activations.back()[static_cast<std::size_t>(i * density_outputs)]);
}

}  // namespace orbitfuse::nerf
