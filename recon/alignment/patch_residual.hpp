// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ceres/rotation.h>

#include "core/geometry/camera.hpp"
#include "recon/alignment/patch_matching.hpp"

namespace orbitfuse {

/// Where a camera whose pose and lens are corrected sees a point of its axes; false behind it.
/// `correction`: angle-axis and translation; `log_focal`: logarithm of what `camera`'s focal
/// lengths are scaled by; `radial`: k1 of its lens (Brown, normalised coordinates), beside none of
/// its own.
template <class T>
bool corrected_pixel(const Camera& camera, const T* correction, const T* log_focal, T radial,
                     const T* point, T* pixel) {
  T moved[3];
  ceres::AngleAxisRotatePoint(correction, point, moved);
  for (int i = 0; i < 3; ++i) moved[i] += correction[3 + i];
  if (!(moved[2] > T(1e-6))) return false;
  const T x = moved[0] / moved[2], y = moved[1] / moved[2];
  const T scale = exp(log_focal[0]) * (T(1) + radial * (x * x + y * y));
  pixel[0] = scale * T(camera.fx) * x + T(camera.cx);
  pixel[1] = scale * T(camera.fy) * y + T(camera.cy);
  return true;
}

/// Ceres residual of two values, weighted pixels: how far the patch is seen from where a correction
/// puts it, of the pose, of the focal length and, where it is a parameter, of the lens's k1.
struct PatchResidual {
  PatchMatch match;
  Camera camera;

  template <class T>
  bool operator()(const T* correction, const T* log_focal, T* residual) const {
    const T radial(0);
    return (*this)(correction, log_focal, &radial, residual);
  }

  template <class T>
  bool operator()(const T* correction, const T* log_focal, const T* radial, T* residual) const {
    const T point[3] = {T(match.point.x()), T(match.point.y()), T(match.point.z())};
    T pixel[2];
    if (!corrected_pixel(camera, correction, log_focal, radial[0], point, pixel)) return false;
    const T dx = pixel[0] - T(match.seen.x()), dy = pixel[1] - T(match.seen.y());
    residual[0] = T(match.sqrt_weight(0, 0)) * dx + T(match.sqrt_weight(0, 1)) * dy;
    residual[1] = T(match.sqrt_weight(1, 0)) * dx + T(match.sqrt_weight(1, 1)) * dy;
    return true;
  }
};

}  // namespace orbitfuse
