// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace orbitfuse::nerf::test {

/// The slope of `loss` along the gradient itself, the best conditioned direction, must be the
/// gradient's length. `loss()` is asked with `values` moved by `step` along it, to either side.
template <class Loss>
void expect_slope(std::vector<float>& values, const std::vector<float>& gradient, double step,
                  double tolerance, const Loss& loss) {
  double length = 0;
  for (const float g : gradient) length += double{g} * g;
  length = std::sqrt(length);
  ASSERT_GT(length, 1e-6);
  const std::vector<float> kept = values;
  double side[2];
  for (int k = 0; k < 2; ++k) {
    for (std::size_t i = 0; i < gradient.size(); ++i)
      values[i] = kept[i] + static_cast<float>((k == 0 ? step : -step) * gradient[i] / length);
    side[k] = loss();
  }
  values = kept;
  EXPECT_NEAR((side[0] - side[1]) / (2 * step), length, tolerance * length);
}

}  // namespace orbitfuse::nerf::test
