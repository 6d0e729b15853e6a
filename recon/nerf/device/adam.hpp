// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/nerf/device/launch.hpp"
#include "recon/nerf/kernels/kernels.hpp"

// Adam on a device (as Kernels::adam). None moves where the step's gradients are not all finite.
namespace orbitfuse::nerf::ORBITFUSE_ENGINE {

constexpr float no_limit = 3e38f;  ///< of numbers that aren't kept in half precision

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

using device::DenseLayer;
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
    const float value = adam_step(step, at, i, gradient[i], no_limit);
    int l = 0;
    while (l + 1 < layers.count && i >= layers.layer[l + 1].offset) ++l;
    const DenseLayer& layer = layers.layer[l];
    const long inner = i - layer.offset, in = inner / layer.outputs, out = inner % layer.outputs;
    transposed[layer.offset + out * layer.inputs + in] = value;
  }
};

/// A thread a view.
struct AdamOffsets {
  AdamStep step;
  Moments at;
  long long* gradient;  ///< cleared
  const int* trains;
  long long* sum;  ///< of the training views' offsets afterwards
  const int* finite;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    const float raw = value_of(gradient[i]);
    gradient[i] = 0;
    if (*finite == 0) return;
    adam_step(step, at, i, raw, no_limit);
    if (trains[i] != 0) add_to(sum, fixed_of(at.value[i]));
  }
};

/// The mean offset is the scene's temperature, not drift.
struct CenterOffsets {
  Moments at;
  const int* trains;
  const long long* sum;
  int training_count;
  const int* finite;

  ORBITFUSE_HOST_DEVICE void operator()(int i) const {
    if (*finite != 0 && trains[i] != 0)
      at.value[i] -= value_of(*sum) / static_cast<float>(training_count);
  }
};

}  // namespace orbitfuse::nerf::ORBITFUSE_ENGINE
