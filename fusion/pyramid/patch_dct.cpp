// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pyramid/patch_dct.hpp"

#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace orbitfuse::fusion {
namespace {

constexpr int side = 8;
using Patch = Eigen::Matrix<float, side, side, Eigen::RowMajor>;

/// Orthonormal DCT-II, one basis vector a row.
Patch dct_basis() {
  Patch basis;
  for (int k = 0; k < side; ++k)
    for (int i = 0; i < side; ++i)
      basis(k, i) = static_cast<float>(std::sqrt((k > 0 ? 2.0 : 1.0) / side) *
                                       std::cos(std::numbers::pi * (i + 0.5) * k / side));
  return basis;
}

}  // namespace

PatchActivity patch_activity(const Plane& image, int x, int y) {
  static const Patch basis = dct_basis();
  const Eigen::Map<const Patch, 0, Eigen::OuterStride<>> patch(
      image[y] + x, Eigen::OuterStride<>(static_cast<Eigen::Index>(image.step1())));
  const Patch along_rows = patch.lazyProduct(basis.transpose());
  const Patch coefficients = basis.lazyProduct(along_rows);
  return {coefficients.cwiseAbs().sum() - std::abs(coefficients(0, 0)), coefficients(0, 0) * side};
}

}  // namespace orbitfuse::fusion
