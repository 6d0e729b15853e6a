// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ceres/rotation.h>

#include "core/geometry/camera.hpp"
#include "recon/alignment/patch_matching.hpp"

namespace orbitfuse {

/// Ceres residual of two values, weighted pixels: how far the patch is seen from where a correction
/// puts it.
/// `correction`: angle-axis and translation, applied to the point in the rendering camera's axes;
/// `log_focal`: logarithm of what `camera`'s focal lengths are scaled by.
struct PatchResidual {
  PatchMatch match;
  Camera camera;

  template <class T>
  bool operator()(const T* correction, const T* log_focal, T* residual) const {
    const T point[3] = {T(match.point.x()), T(match.point.y()), T(match.point.z())};
    T moved[3];
    ceres::AngleAxisRotatePoint(correction, point, moved);
    for (int i = 0; i < 3; ++i) moved[i] += correction[3 + i];
    if (!(moved[2] > T(1e-6))) return false;
    const T scale = exp(log_focal[0]);
    const T dx = scale * T(camera.fx) * moved[0] / moved[2] + T(camera.cx) - T(match.seen.x());
    const T dy = scale * T(camera.fy) * moved[1] / moved[2] + T(camera.cy) - T(match.seen.y());
    residual[0] = T(match.sqrt_weight(0, 0)) * dx + T(match.sqrt_weight(0, 1)) * dy;
    residual[1] = T(match.sqrt_weight(1, 0)) * dx + T(match.sqrt_weight(1, 1)) * dy;
    return true;
  }
};

}  // namespace orbitfuse
