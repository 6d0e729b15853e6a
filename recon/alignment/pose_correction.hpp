// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "core/geometry/rotation_vector.hpp"
#include "core/geometry/transform.hpp"

// What a solve finds: small changes of poses and of a focal length.
namespace orbitfuse {

/// Angle-axis and translation, applied to points in the camera's axes.
using PoseCorrection = std::array<double, 6>;

inline Rigid3d rigid_of(const PoseCorrection& c) {
  return {turned_by({c[0], c[1], c[2]}), {c[3], c[4], c[5]}};
}

/// Ceres residual: the first value of a block, believed to be `mean`, in sigmas.
struct ValuePrior {
  double mean, sigma;
  template <class T>
  bool operator()(const T* value, T* residual) const {
    residual[0] = (value[0] - T(mean)) / T(sigma);
    return true;
  }
};

}  // namespace orbitfuse
