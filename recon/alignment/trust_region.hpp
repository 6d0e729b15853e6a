// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

// Levenberg's and Marquardt's way down a robust sum of squares, as Ceres has it by default, for
// problems whose structure a solver of their own uses.
namespace orbitfuse {

/// Cauchy's loss of a squared residual and the root of its slope, by which the linear problem
/// weighs it.
struct Cauchy {
  double cost, root;
  Cauchy(double squared, double scale) {
    const double b = scale * scale, sum = 1 + squared / b;
    cost = b * std::log(sum);
    root = 1 / std::sqrt(sum);
  }
};

/// Damping of a diagonal entry, in the scale of the Jacobian's columns.
inline double damping(double diagonal, double radius) {
  constexpr double most = 1e32, least = 1e-6;
  const double column = 1 + std::sqrt(diagonal);
  return std::clamp(diagonal / (column * column), least, most) * column * column / radius;
}

struct TrustRegionOptions {
  int max_iterations = 60;
  /// Enough: the cost falls, or the parameters move, by no more of themselves.
  double cost_tolerance = 1e-6, parameter_tolerance = 1e-8;
};

struct TrustRegionEnd {
  bool usable = false;  ///< the start could be linearised
  bool converged = false;
};

/// `Problem` has State, Linear (with its `cost`) and Step (with the linear problem's gain,
/// `predicted`, not positive where no step was found, and `squared_length`), and
///   bool linearise(const State&, Linear&)   false: not finite there
///   Step step(const Linear&, double radius)
///   State moved(const State&, const Step&)
///   double squared_norm(const State&)
template <class Problem>
TrustRegionEnd minimise(const Problem& problem, typename Problem::State& state,
                        const TrustRegionOptions& options) {
  constexpr double first_radius = 1e4, most_radius = 1e16, least_radius = 1e-32;
  constexpr double least_gain = 1e-3;  // share of what was predicted
  typename Problem::Linear linear, tried;
  if (!problem.linearise(state, linear)) return {};
  double radius = first_radius, shrink = 2;
  for (int i = 0; i < options.max_iterations && radius > least_radius; ++i) {
    const typename Problem::Step next = problem.step(linear, radius);
    if (next.predicted > 0) {
      const double norm = std::sqrt(problem.squared_norm(state));
      if (std::sqrt(next.squared_length) <=
          options.parameter_tolerance * (norm + options.parameter_tolerance))
        return {true, true};
      typename Problem::State there = problem.moved(state, next);
      const bool finite = problem.linearise(there, tried);
      const double gain = finite ? (linear.cost - tried.cost) / next.predicted : 0;
      if (gain > least_gain) {
        const double before = linear.cost, fall = before - tried.cost;
        state = std::move(there);
        std::swap(linear, tried);
        radius = std::min(radius / std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)), most_radius);
        shrink = 2;
        if (fall <= options.cost_tolerance * before) return {true, true};
        continue;
      }
    }
    radius /= shrink;
    shrink *= 2;
  }
  return {true, false};
}

}  // namespace orbitfuse
