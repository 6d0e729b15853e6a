// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace orbitfuse::nerf {

/// Normal equations of one view's motion x = (shift, turn) in camera axes, normalised units:
/// sum w |slope * motion(x) - (shown - photo)|^2 over its rays.
struct PoseSums {
  std::array<double, 36> normal{};
  std::array<double, 6> right{};
  std::int64_t rays = 0;  ///< as wide as the others: stored as it lies, without padding
  void add(const PoseSums& other);
};

}  // namespace orbitfuse::nerf
