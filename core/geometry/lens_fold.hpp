// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include "core/geometry/camera.hpp"

namespace orbitfuse {

/// Squared distance from the axis (normalised, x/z and y/z) beyond which a lens model turns back:
/// the first zero of 1 + 3 k1 r^2 + 5 k2 r^4, the derivative of the distorted radius. Points
/// farther out land in the picture, where nobody saw them. Infinite where it never does.
inline double fold_of(const Camera& camera) {
  constexpr double none = std::numeric_limits<double>::infinity();
  const double a = 5 * camera.k2, b = 3 * camera.k1, inside = b * b - 4 * a;
  if (a == 0) return b < 0 ? -1 / b : none;
  if (inside < 0) return none;
  double first = none;
  for (const double sign : {1.0, -1.0})
    if (const double root = (-b + sign * std::sqrt(inside)) / (2 * a); root > 0 && root < first)
      first = root;
  return first;
}

/// Whether the lens shows a point in front of the camera where it projects to.
inline bool lens_holds(const Camera& camera, const Eigen::Vector3d& x_in_cam) {
  return x_in_cam.head<2>().squaredNorm() < fold_of(camera) * x_in_cam.z() * x_in_cam.z();
}

}  // namespace orbitfuse
