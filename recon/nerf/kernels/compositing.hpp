// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

// Emission-absorption volume rendering along one ray (Max 1995; Mildenhall et al. 2020, eq. 3) and
// its exact gradients. Templates, so that tests run them in double.
namespace orbitfuse::nerf {

/// weights[i] = T_i (1 - exp(-sigma_i dt_i)), transmittance[i] = light left after sample i. Stops
/// when less than `stop` is left and returns the number of samples used.
template <class T>
ORBITFUSE_HOST_DEVICE int composite(int count, const T* sigma, const T* dt, T stop, T* weights,
                                    T* transmittance) {
  T light = 1;
  for (int i = 0; i < count; ++i) {
    const T kept = std::exp(-sigma[i] * dt[i]);
    weights[i] = light * (1 - kept);
    light *= kept;
    transmittance[i] = light;
    if (light < stop) return i + 1;
  }
  return count;
}

/// dsigma[i] = dt_i (T_{i+1} g_i - sum_{j>i} w_j g_j) for g = dL/dw; `behind` is the same sum over
/// what the ray meets after these samples (the background: T_end * its g).
template <class T>
ORBITFUSE_HOST_DEVICE void composite_backward(int count, const T* dt, const T* weights,
                                              const T* transmittance, const T* dweights, T behind,
                                              T* dsigma) {
  for (int i = count - 1; i >= 0; --i) {
    dsigma[i] = dt[i] * (transmittance[i] * dweights[i] - behind);
    behind += weights[i] * dweights[i];
  }
}

/// Distortion loss (Mip-NeRF 360, eq. 15): sum_ij w_i w_j |s_i - s_j| + 1/3 sum_i w_i^2 ds_i in
/// O(n); adds scale * gradient to dweights and returns the loss.
template <class T>
ORBITFUSE_HOST_DEVICE T distortion_loss(int count, const T* weights, const T* s, const T* ds,
                                        T scale, T* dweights) {
  T total_w = 0, total_ws = 0;
  for (int i = 0; i < count; ++i) {
    total_w += weights[i];
    total_ws += weights[i] * s[i];
  }
  T before_w = 0, before_ws = 0, loss = 0;
  for (int i = 0; i < count; ++i) {
    const T w = weights[i], ws = w * s[i];
    const T after_w = total_w - before_w - w, after_ws = total_ws - before_ws - ws;
    const T pull = s[i] * (before_w - after_w) - before_ws + after_ws;
    loss += w * pull + w * w * ds[i] / 3;
    dweights[i] += scale * (2 * pull + 2 * w * ds[i] / 3);
    before_w += w;
    before_ws += ws;
  }
  return loss;
}

}  // namespace orbitfuse::nerf
