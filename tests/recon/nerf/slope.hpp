// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/numeric/random.hpp"
#include "recon/nerf/field/network.hpp"

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

/// What scatter() adds to a grid's table for gradients [level][sample][feature], as a list.
inline std::vector<float> table_gradient(const Kernels& kernels, const HashEncoding& grid,
                                         const float* position01, int count,
                                         const float* gradients) {
  GridTable table;
  table.resize(grid.levels);
  for (std::size_t l = 0; l < grid.levels.size(); ++l) {
    const GridTable::Level level = table.level(grid.levels, l);
    kernels.scatter(
        grid.levels[l], level.lines, level.touched, position01, count,
        gradients + l * static_cast<std::size_t>(count) * static_cast<std::size_t>(grid.features));
  }
  return table.part(&GridLine::grad);
}

/// One part of a parameter set.
struct Part {
  std::string name;
  std::size_t begin, count;
};

inline std::vector<Part> levels_of(const HashEncoding& grid) {
  std::vector<Part> parts;
  for (std::size_t l = 0; l < grid.levels.size(); ++l)
    parts.push_back(
        {"level " + std::to_string(l), static_cast<std::size_t>(grid.levels[l].offset),
         std::size_t{grid.levels[l].entries} * static_cast<std::size_t>(grid.features)});
  return parts;
}

inline std::vector<Part> layers_of(const Mlp& mlp) {
  std::vector<Part> parts;
  for (std::size_t l = 0; l < mlp.layers.size(); ++l)
    parts.push_back({"layer " + std::to_string(l), static_cast<std::size_t>(mlp.layers[l].offset),
                     static_cast<std::size_t>(mlp.layers[l].in * mlp.layers[l].out)});
  return parts;
}

/// Slopes along directions that know nothing of the gradient: random signs over one part, over each
/// in turn and over all. A gradient that lacks something is seen even where it is zero. The error
/// is measured against the slope's standard deviation over such directions, the gradient's length.
/// ReLUs that switch within a step leave 5 % of it at the steps used here; it falls with the step.
template <class Loss>
void expect_random_slopes(std::vector<float>& values, const std::vector<float>& gradient,
                          std::vector<Part> parts, float step, double tolerance, const Loss& loss) {
  parts.push_back({"all", 0, values.size()});
  const std::vector<float> kept = values;
  for (const Part& part : parts) {
    double length = 0;
    for (std::size_t i = part.begin; i < part.begin + part.count; ++i)
      length += double{gradient[i]} * gradient[i];
    length = std::sqrt(length);
    EXPECT_GT(length, 1e-5) << part.name << " learns nothing";
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      SCOPED_TRACE(part.name + ", direction " + std::to_string(seed));
      double expected = 0, side[2];
      for (int k = 0; k < 2; ++k) {
        for (std::size_t i = part.begin; i < part.begin + part.count; ++i) {
          const float sign = random_bits(seed, 97, i) & 1u ? 1.0f : -1.0f;
          if (k == 0) expected += double{gradient[i]} * sign;
          values[i] = kept[i] + (k == 0 ? step : -step) * sign;
        }
        side[k] = loss();
      }
      values = kept;
      EXPECT_NEAR((side[0] - side[1]) / (2 * double{step}), expected, tolerance * length);
    }
  }
}

}  // namespace orbitfuse::nerf::test
