// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>

#include "core/geometry/camera.hpp"

// core's Camera model (OpenCV distortion), templated for automatic derivatives.
namespace orbitfuse {

/// fx, fy, cx, cy, k1, k2, p1, p2.
using Intrinsics = std::array<double, 8>;

inline Intrinsics intrinsics_of(const Camera& c) {
  return {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2};
}

inline void store(const Intrinsics& lens, Camera& c) {
  c.fx = lens[0], c.fy = lens[1], c.cx = lens[2], c.cy = lens[3];
  c.k1 = lens[4], c.k2 = lens[5], c.p1 = lens[6], c.p2 = lens[7];
}

template <class T>
Eigen::Matrix<T, 2, 1> project(const Eigen::Matrix<T, 3, 1>& x_in_cam, const T* lens) {
  const T u = x_in_cam.x() / x_in_cam.z(), v = x_in_cam.y() / x_in_cam.z();
  const T r2 = u * u + v * v;
  const T radial = T(1) + r2 * (lens[4] + r2 * lens[5]);
  const T x = u * radial + T(2) * lens[6] * u * v + lens[7] * (r2 + T(2) * u * u);
  const T y = v * radial + lens[6] * (r2 + T(2) * v * v) + T(2) * lens[7] * u * v;
  return {lens[0] * x + lens[2], lens[1] * y + lens[3]};
}

}  // namespace orbitfuse
