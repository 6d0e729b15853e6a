// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/shade.hpp"
#include "recon/nerf/field/pose_row.hpp"
#include "recon/nerf/kernels/depth_loss.hpp"

// The loss and its gradients along rays, as backward.cpp.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

struct LossNumbers {
  float per_ray, distortion_weight, huber;
};

/// Of squared errors: a field that runs away must not wrap their sum.
constexpr double error_unit = 1.0 / (1 << 20);
constexpr float largest_error = 1e6f;

/// Of a step; squared_error in error_unit.
struct StepSums {
  long long squared_error, channels, rays, samples;
};

/// Cleared by whatever is not finite: nothing moves then.
struct StepState {
  StepSums sums;
  int finite;
};

struct RayLoss {
  ShownRays shown;
  LossNumbers loss;
  const float* offset;      ///< per view
  float *dweight, *dsigma;  ///< along the rays
  Rows dcolor;              ///< of the network's raw outputs
  long long* doffset;       ///< per view
  StepState* state;

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    const DeviceRay& ray = shown.rays[r];
    if (!ray.there) return;
    const RaySamples& samples = shown.samples;
    const Light& light = shown.light;
    const int begin = samples.first[r], end = samples.first[r + 1] - 1, used = light.used[r];
    for (int i = begin; i <= end; ++i) dweight[i] = dsigma[i] = 0;
    float dvalue[3];
    pull(r, ray, dvalue);
    color_gradients(r, dvalue);
    pass_on(r);
    float extra = 0;
    if (loss.distortion_weight > 0)
      extra += distortion_loss(used, light.weight + begin, samples.s + begin, samples.ds + begin,
                               loss.distortion_weight * loss.per_ray, dweight + begin);
    if (ray.distance > 0 && ray.depth_weight > 0)
      extra += depth_loss({ray.distance, ray.depth_weight}, used, samples.t + begin,
                          samples.dt + begin, light.weight + begin, loss.per_ray, dweight + begin);
    if (!is_finite(extra)) state->finite = 0;
    composite_backward(used, samples.dt + begin, light.weight + begin, light.left + begin,
                       dweight + begin, light.weight[end] * dweight[end], dsigma + begin);
    const bool stopped = used < end - begin;
    const int rounded = (used + samples_per_round - 1) / samples_per_round * samples_per_round;
    add_to(&state->sums.samples, 1 + (stopped && rounded < end - begin ? rounded : end - begin));
    add_to(&state->sums.rays, 1);
  }

 private:
  /// dL/d(what the ray shows).
  ORBITFUSE_HOST_DEVICE void pull(int r, const DeviceRay& ray, float dvalue[3]) const {
    float value[3];
    shown.value(r, value);
    float squared = 0, sum = 0;
    for (int c = 0; c < shown.shade.channels; ++c) {
      const float error = value[c] + offset[ray.view] - ray.value[c];
      squared += error * error;
      const float upper = error < loss.huber ? error : loss.huber;
      const float bent = loss.huber > 0 ? (upper > -loss.huber ? upper : -loss.huber) : error;
      dvalue[c] = 2 * bent * loss.per_ray / static_cast<float>(shown.shade.channels);
      sum += dvalue[c];
    }
    if (!is_finite(squared)) state->finite = 0;
    const float bounded = squared < largest_error ? squared : largest_error;
    add_to(&state->sums.squared_error, static_cast<long long>(bounded / error_unit));
    add_to(&state->sums.channels, shown.shade.channels);
    add_to(doffset + ray.view, fixed_of(sum));
  }

  ORBITFUSE_HOST_DEVICE void color_gradients(int r, const float dvalue[3]) const {
    const float* weight = shown.light.weight;
    for (int row = shown.first_row[r]; row < shown.first_row[r + 1]; ++row) {
      const int sample = shown.sample_of[row];
      float g = 0;
      for (int c = 0; c < shown.shade.channels; ++c) {
        const float v = shown.shade.value(shown.color(c, row));
        g += dvalue[c] * v;
        dcolor(c, row) = weight[sample] * dvalue[c] * shown.shade.slope(v);
      }
      dweight[sample] = g;
    }
  }

  /// A sample without a colour counts as showing what lies behind it, so that it is neither wanted
  /// nor unwanted.
  ORBITFUSE_HOST_DEVICE void pass_on(int r) const {
    const Light& light = shown.light;
    const int* sample_of = shown.sample_of;
    const int begin = shown.samples.first[r], first = shown.first_row[r];
    int row = shown.first_row[r + 1] - 1;
    float behind = 0;
    for (int i = begin + light.used[r] - 1; i >= begin; --i) {
      for (; row >= first && sample_of[row] > i; --row)
        behind += light.weight[sample_of[row]] * dweight[sample_of[row]];
      const bool colored = row >= first && sample_of[row] == i;
      if (!colored && light.left[i] > 1e-6f) dweight[i] = behind / light.left[i];
    }
  }
};

/// The density network's output gradients: the density's own first, the colour network's on top.
struct DensityGradient {
  SampleCount samples;
  const float *dsigma, *sigma;
  Rows ddensity;

  ORBITFUSE_HOST_DEVICE void operator()(int s) const {
    if (s >= *samples.counted) return;
    for (int k = 0; k < density_outputs; ++k) ddensity(k, s) = 0;
    const float d = dsigma[s];
    if (d != 0) ddensity(0, s) = d * sigma[s];
  }
};

struct AddColorGradient {
  SampleCount rows;
  const int* sample_of;
  Rows dcolor_in, ddensity;

  ORBITFUSE_HOST_DEVICE void operator()(int row) const {
    if (row >= *rows.counted) return;
    for (int k = 0; k < density_outputs; ++k) ddensity(k, sample_of[row]) += dcolor_in(k, row);
  }
};

/// Normal equations of a view's motion, in units of 2^-20: the upper triangle, the right side,
/// rays.
constexpr int pose_numbers = 28;
constexpr double pose_unit = 1.0 / (1 << 20);

/// As Trainer::watch_poses() and add_ray().
struct WatchPoses {
  Photos photos;
  ShownRays shown;
  const float* offset;
  long long* sums;  ///< [view][pose_numbers]

  ORBITFUSE_HOST_DEVICE void operator()(int r) const {
    const DeviceRay& ray = shown.rays[r];
    if (!ray.there) return;
    const Light& light = shown.light;
    const int begin = shown.samples.first[r];
    float opacity = 0, distance = 0;
    for (int i = begin; i < begin + light.used[r]; ++i) {
      opacity += light.weight[i];
      distance += light.weight[i] * shown.samples.t[i];
    }
    if (opacity < seen_opacity) return;
    float value[3];
    shown.value(r, value);
    add(ray, distance / opacity, value);
  }

 private:
  ORBITFUSE_HOST_DEVICE void add(const DeviceRay& ray, float distance, const float* value) const {
    constexpr int reach = slope_reach_px;
    const TrainingPhoto& view = photos.view[ray.view];
    const RayNumbers& numbers = view.rays;
    if (ray.x < reach || ray.y < reach || ray.x >= numbers.width - reach ||
        ray.y >= numbers.height - reach)
      return;
    double p[3];
    through(numbers, photos.lattice + view.lattice, ray.x + 0.5, ray.y + 0.5, p);
    const double length = sqrt(p[0] * p[0] + p[1] * p[1] + 1);
    for (double& v : p) v *= distance / length;
    if (!(p[2] > 1e-6)) return;
    const auto at = [&](int dx, int dy, int c) -> double {
      const long pixel = static_cast<long>(ray.y + dy) * numbers.width + ray.x + dx;
      return photos.target[(view.pixel + pixel) * photos.channels + c];
    };
    long long* to = sums + static_cast<long>(ray.view) * pose_numbers;
    bool said = false;
    for (int c = 0; c < photos.channels; ++c) {
      const double slope_x = (at(reach, 0, c) - at(-reach, 0, c)) / (2 * reach),
                   slope_y = (at(0, reach, c) - at(0, -reach, c)) / (2 * reach);
      const double error = static_cast<double>(value[c] + offset[ray.view]) - at(0, 0, c);
      const double all = slope_x + slope_y + error;
      if (!(all - all == 0)) continue;
      double row[6];
      pose_row(numbers.fx, numbers.fy, p, slope_x, slope_y, row);
      const double weight = pose_weight(error);
      said = true;
      int k = 0;
      for (int a = 0; a < 6; ++a)
        for (int b = a; b < 6; ++b) add_to(to + k++, rounded(weight * row[a] * row[b]));
      for (const double r : row) add_to(to + k++, rounded(weight * error * r));
    }
    if (said) add_to(to + pose_numbers - 1, 1);
  }
  ORBITFUSE_HOST_DEVICE static long long rounded(double value) {
    // A ray that says more is beside itself; 400,000 of these fit, the most that 25 steps draw.
    constexpr double most = 2e7;
    const double upper = value < most ? value : most, held = upper > -most ? upper : -most;
    return static_cast<long long>(held / pose_unit);
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
