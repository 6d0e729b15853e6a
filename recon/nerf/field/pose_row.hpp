// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/host_device.hpp"

namespace orbitfuse::nerf {

inline constexpr int slope_reach_px =
    2;  ///< slopes are taken over twice this: errors of that size still pull home

inline constexpr float seen_opacity = 0.5f;  ///< from which on a ray has seen something

/// How a pixel's value changes with its camera's motion (shift, turn), in camera axes: the photo's
/// slope there times the projection's of the point p. The lens bends motion little; what it does to
/// the slope of a step, the next step makes good.
ORBITFUSE_HOST_DEVICE inline void pose_row(double fx, double fy, const double p[3], double slope_x,
                                           double slope_y, double row[6]) {
  const double gx = slope_x * fx / p[2], gy = slope_y * fy / p[2];
  const double gz = -(gx * p[0] + gy * p[1]) / p[2];
  row[0] = gx;
  row[1] = gy;
  row[2] = gz;
  row[3] = p[1] * gz - p[2] * gy;
  row[4] = p[2] * gx - p[0] * gz;
  row[5] = p[0] * gy - p[1] * gx;
}

/// Of a ray's difference between field and photo, in units of the span: what the scene hides or
/// reflects doesn't count for more (Huber).
ORBITFUSE_HOST_DEVICE inline double pose_weight(double error) {
  constexpr double huber = 0.05;
  const double size = std::fabs(error);
  return size > huber ? huber / size : 1.0;
}

}  // namespace orbitfuse::nerf
