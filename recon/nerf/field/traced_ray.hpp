// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

/// What a ray showed. Distances along it, in normalised units.
struct TracedRay {
  float value[3];    ///< in units of the span
  float distance;    ///< where as much light is left as makes a surface (half: the median); NaN:
                     ///< more is left all the way
  float opacity;     ///< 0..1
  float begin, end;  ///< where light fades: the sample before it does, and behind what stops the
                     ///< ray; `end` is the largest float where nothing does
  float forward;     ///< as Ray
  bool starts_dark;  ///< within something from its first sample on: a surface may lie before that
  bool there;        ///< false: the lens has no such ray, nothing else is set
};

inline constexpr float no_end =
    3.402823466e38f;  ///< of a ray that nothing stops: the largest float

/// What light's way along a ray says: `count` samples at t, each dt long, `left` of the light
/// behind them. The surface lies where `surface_light` is left. Value, forward and there are the
/// caller's.
ORBITFUSE_HOST_DEVICE inline void read_light(int count, const float* t, const float* dt,
                                             const float* left, float stop, float surface_light,
                                             TracedRay& out) {
  constexpr float all_but_nothing = 0.98f, least_light = 0.8f;
  out.opacity = 0;
  out.begin = 0;
  out.end = no_end;
  out.starts_dark = false;
  if (count == 0) return;
  int fading = 0, dark = 0;
  while (fading < count && !(left[fading] < all_but_nothing)) ++fading;
  if (fading < count) {
    const float start = t[fading] - dt[fading];
    out.begin = fading > 0 ? t[fading - 1] : start > 0 ? start : 0.0f;
  }
  // A quantile stays on a surface where a mean would float between two.
  while (dark < count && !(left[dark] < surface_light)) ++dark;
  if (dark < count) {
    const float before = dark > 0 ? left[dark - 1] : 1.0f, lost = before - left[dark];
    const float part = (before - surface_light) / (lost > 1e-6f ? lost : 1e-6f);
    out.distance = t[dark] + (part - 0.5f) * dt[dark];
  }
  out.opacity = 1 - left[count - 1];
  out.starts_dark = left[0] < least_light;
  if (left[count - 1] < stop) out.end = t[count - 1] + dt[count - 1];
}

}  // namespace orbitfuse::nerf
