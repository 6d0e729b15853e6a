// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/backward.hpp"

#include <algorithm>
#include <cmath>

#include "recon/nerf/kernels/compositing.hpp"
#include "recon/nerf/kernels/depth_loss.hpp"

namespace orbitfuse::nerf {
namespace {

void ensure(std::vector<float>& buffer, std::size_t count) {
  if (buffer.size() < count) buffer.resize(count + count / 4);
}

}  // namespace

void BlockGradients::reset(const FieldState& field) {
  mlp.assign(field.main.mlp.weights.size(), 0);
  color.assign(field.color.weights.size(), 0);
  offsets.assign(field.image_offsets.size(), 0);
  for (std::size_t i = 0; i < field.proposals.size(); ++i)
    proposals[i].assign(field.proposals[i].mlp.weights.size(), 0);
  squared_error = distortion = depth = interlevel = 0;
  channels = 0;
  finite = true;
}

void BlockGradients::add(const BlockGradients& other) {
  const auto sum = [](std::vector<float>& a, const std::vector<float>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  };
  sum(mlp, other.mlp);
  sum(color, other.color);
  sum(offsets, other.offsets);
  for (std::size_t i = 0; i < proposals.size(); ++i) sum(proposals[i], other.proposals[i]);
  squared_error += other.squared_error;
  distortion += other.distortion;
  depth += other.depth;
  interlevel += other.interlevel;
  channels += other.channels;
  finite = finite && other.finite;
}

bool BlockGradients::all_parts_finite() const {
  const auto numbers = [](const std::vector<float>& part) {
    return all_finite(part.data(), part.size());
  };
  return finite && numbers(mlp) && numbers(color) && numbers(offsets) &&
         std::all_of(std::begin(proposals), std::end(proposals), numbers) &&
         std::isfinite(squared_error) && std::isfinite(distortion) && std::isfinite(depth) &&
         std::isfinite(interlevel);
}

void backward(const FieldState& field, const Kernels& kernels, const LossSettings& settings,
              const std::vector<RayTarget>& targets, RayBlock& b, BlockGradients& gradients,
              std::vector<float>& grid) {
  const int n = b.samples();
  const auto count = static_cast<std::size_t>(n);
  const int channels = field.channels();
  const std::size_t rows = b.active.size();
  ensure(b.dweight, count);
  ensure(b.dsigma, count);
  ensure(b.s, count);
  ensure(b.ds, count);
  ensure(b.dcolor_in, rows * color_inputs);
  ensure(b.ddensity, count * density_outputs);
  b.dcolor.assign(rows * color_outputs, 0);
  std::fill_n(b.dweight.begin(), n, 0.0f);
  std::fill_n(b.dsigma.begin(), n, 0.0f);
  std::fill_n(b.ddensity.begin(), count * density_outputs, 0.0f);
  for (std::size_t i = 0; i < count; ++i) {
    // Distances enter the distortion loss by s = t / (1 + t), which is in [0, 1] as published.
    const float inverse = 1.0f / (1.0f + b.t[i]);
    b.s[i] = b.t[i] * inverse;
    b.ds[i] = b.dt[i] * inverse * inverse;
  }

  int row = 0;
  for (std::size_t r = 0; r < b.rays.size(); ++r) {
    const RayTarget& target = targets[r];
    const int begin = b.first[r], end = b.first[r + 1] - 1, used = b.used[r];
    const int first_row = row;
    float value[3], dvalue[3];
    ray_value(field, b, static_cast<int>(r), row, value);
    const float offset = field.image_offsets.value[static_cast<std::size_t>(target.view)];
    for (int c = 0; c < channels; ++c) {
      const float error = value[c] + offset - target.value[c];
      gradients.squared_error += error * error;
      const float pull =
          settings.huber > 0 ? std::clamp(error, -settings.huber, settings.huber) : error;
      dvalue[c] = 2 * pull * settings.per_ray / static_cast<float>(channels);
      gradients.offsets[static_cast<std::size_t>(target.view)] += dvalue[c];
    }
    gradients.channels += channels;

    // dL/dw of coloured samples, from the back; a sample without a colour counts as showing what
    // lies behind it, so that it is neither wanted nor unwanted.
    float behind = 0;
    for (int i = row - 1; i >= first_row; --i) {
      const int sample = b.active[static_cast<std::size_t>(i)];
      float g = 0;
      for (int c = 0; c < channels; ++c) {
        const float v = b.value[static_cast<std::size_t>(i * channels + c)];
        const float w = b.weight[static_cast<std::size_t>(sample)];
        g += dvalue[c] * v;
        const float slope = field.modality == Modality::visible ? v * (1 - v) : 1.0f;
        b.dcolor[static_cast<std::size_t>(i * color_outputs + c)] = w * dvalue[c] * slope;
      }
      b.dweight[static_cast<std::size_t>(sample)] = g;
    }
    int i_active = row - 1;
    for (int i = begin + used - 1; i >= begin; --i) {
      while (i_active >= first_row && b.active[static_cast<std::size_t>(i_active)] > i) {
        const auto a = static_cast<std::size_t>(b.active[static_cast<std::size_t>(i_active)]);
        behind += b.weight[a] * b.dweight[a];
        --i_active;
      }
      const bool colored =
          i_active >= first_row && b.active[static_cast<std::size_t>(i_active)] == i;
      const auto k = static_cast<std::size_t>(i);
      if (!colored && b.light[k] > 1e-6f) b.dweight[k] = behind / b.light[k];
    }
    const auto at = static_cast<std::size_t>(begin);
    if (settings.distortion_weight > 0)
      gradients.distortion +=
          distortion_loss(used, &b.weight[at], &b.s[at], &b.ds[at],
                          settings.distortion_weight * settings.per_ray, &b.dweight[at]);
    if (target.distance > 0 && target.depth_weight > 0)
      gradients.depth += depth_loss({target.distance, target.depth_weight}, used, &b.t[at],
                                    &b.dt[at], &b.weight[at], settings.per_ray, &b.dweight[at]);
    const auto last = static_cast<std::size_t>(end);
    const float background = b.weight[last] * b.dweight[last];
    composite_backward(used, &b.dt[at], &b.weight[at], &b.light[at], &b.dweight[at], background,
                       &b.dsigma[at]);
  }

  const auto mlp_rows = static_cast<int>(rows);
  field.color.backward(kernels, mlp_rows, b.color_in.data(), b.color, b.dcolor.data(),
                       b.dcolor_in.data(), b.scratch_a, b.scratch_b, gradients.color.data());
  for (std::size_t i = 0; i < rows; ++i)
    std::copy_n(&b.dcolor_in[i * color_inputs], density_outputs,
                &b.ddensity[static_cast<std::size_t>(b.active[i]) * density_outputs]);
  for (std::size_t i = 0; i < count; ++i)
    b.ddensity[i * density_outputs] += b.dsigma[i] * b.sigma[i];

  const auto width = static_cast<std::size_t>(field.main.grid.width);
  ensure(b.dfeatures, count * width);
  field.main.mlp.backward(kernels, n, b.features.data(), b.density, b.ddensity.data(),
                          b.dfeatures.data(), b.scratch_a, b.scratch_b, gradients.mlp.data());
  gradients.finite = gradients.finite && all_finite(b.dfeatures.data(), count * width);

  by_level(field.main.grid, b.dfeatures, count, grid);
}

}  // namespace orbitfuse::nerf
