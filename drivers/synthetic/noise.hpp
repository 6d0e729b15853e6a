// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/numeric/random.hpp"

// Own random numbers: std's distributions may differ between libraries, and the scene must not.
namespace orbitfuse::synthetic {

inline std::uint64_t mix(std::uint64_t a, std::uint64_t b) { return split_mix(a ^ split_mix(b)); }

/// Uniform in [0, 1).
double uniform(std::uint64_t hash);

/// A stream of numbers for one purpose.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double gaussian();  ///< mean 0, sigma 1 (Box-Muller)

 private:
  std::uint64_t state_;
};

/// Smooth value noise in [0, 1], feature size 1.
double value_noise(const Eigen::Vector3d& x, std::uint64_t seed);
/// Octaves of it, each half as large and half as strong; in [0, 1].
double fractal_noise(const Eigen::Vector3d& x, int octaves, std::uint64_t seed);

}  // namespace orbitfuse::synthetic
