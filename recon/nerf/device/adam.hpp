// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/launch.hpp"
#include "recon/nerf/kernels/kernels.hpp"

// Adam on a device (as Kernels::adam). None moves where the step's gradients are not all finite.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

struct Moments {
  float *value, *first, *second;
};

/// Numbers whose gradient is exactly 0 keep their state.
ORBITFUSE_HOST_DEVICE inline float adam_step(const AdamStep& step, const Moments& at, long i,
                                             float raw, float limit) {
  constexpr float largest = 1e15f;  // its square must stay finite
  if (raw == 0) return at.value[i];
  const float upper = raw < largest ? raw : largest, bounded = upper > -largest ? upper : -largest;
  const float g = bounded + step.weight_decay * at.value[i];
  const float m = at.first[i] + (1 - step.beta1) * (g - at.first[i]);
  const float v = at.second[i] + (1 - step.beta2) * (g * g - at.second[i]);
  const float change =
      m * (step.learning_rate * step.correction1) / (sqrtf(v * step.correction2) + step.epsilon);
  const float next = at.value[i] - change, low = next < limit ? next : limit;
  at.first[i] = m;
  at.second[i] = v;
  return at.value[i] = low > -limit ? low : -limit;
}

struct AdamTable {
  AdamStep step;
  Moments at;
  long long* gradient;  ///< cleared
  std::uint16_t* half;
  const int* finite;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const long long sum = gradient[i];
    if (sum == 0) return;
    gradient[i] = 0;
    if (*finite != 0) half[i] = half_of(adam_step(step, at, i, value_of(sum), max_half));
  }
};

struct DenseLayer {
  int inputs, outputs;
  long offset;  ///< of its weights among the network's
};
constexpr int most_layers = 3;
struct Layers {
  DenseLayer layer[most_layers];
  int count;
};

struct AdamNetwork {
  AdamStep step;
  Layers layers;
  Moments at;
  const float* gradient;
  float* transposed;
  const int* finite;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    if (*finite == 0) return;
    constexpr float no_limit = 3e38f;
    const float value = adam_step(step, at, i, gradient[i], no_limit);
    int l = 0;
    while (l + 1 < layers.count && i >= layers.layer[l + 1].offset) ++l;
    const DenseLayer& layer = layers.layer[l];
    const long inner = i - layer.offset, in = inner / layer.outputs, out = inner % layer.outputs;
    transposed[layer.offset + out * layer.inputs + in] = value;
  }
};

/// One thread: views are few.
struct AdamOffsets {
  AdamStep step;
  Moments at;
  long long* gradient;  ///< cleared
  const int* training;
  int training_count, count;
  const int* finite;

  ORBITFUSE_HOST_DEVICE void operator()(int) const {
    for (int i = 0; i < count; ++i) {
      const float sum = value_of(gradient[i]);
      gradient[i] = 0;
      constexpr float no_limit = 3e38f;
      if (*finite != 0) adam_step(step, at, i, sum, no_limit);
    }
    if (*finite == 0) return;
    // The mean offset is the scene's temperature, not drift.
    double mean = 0;
    for (int k = 0; k < training_count; ++k) mean += at.value[training[k]];
    mean /= training_count;
    for (int k = 0; k < training_count; ++k) at.value[training[k]] -= static_cast<float>(mean);
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
