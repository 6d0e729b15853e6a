// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::nerf {

/// What a ray showed. Distances along it, in normalised units.
struct TracedRay {
  float value[3];    ///< in units of the span
  float distance;    ///< median: where half of the light is gone; NaN: it isn't
  float opacity;     ///< 0..1
  float begin, end;  ///< where light fades: the sample before it does, and behind what stops the
                     ///< ray; `end` is the largest float where nothing does
  float forward;     ///< as Ray
  bool starts_dark;  ///< within something from its first sample on: a surface may lie before that
  bool there;        ///< false: the lens has no such ray, nothing else is set
};

}  // namespace orbitfuse::nerf
