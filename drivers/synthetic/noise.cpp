// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/noise.hpp"

#include <cmath>
#include <numbers>

namespace orbitfuse::synthetic {

double uniform(std::uint64_t hash) { return static_cast<double>(hash >> 11) * 0x1p-53; }

double Random::uniform() {
  state_ += split_mix_step;
  return synthetic::uniform(split_mix(state_));
}

double Random::gaussian() {
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

double value_noise(const Eigen::Vector3d& x, std::uint64_t seed) {
  const Eigen::Vector3d cell = x.array().floor();
  const Eigen::Vector3d f = x - cell;
  const Eigen::Vector3d s = f.array() * f.array() * (3 - 2 * f.array());
  const auto corner = [&](int dx, int dy, int dz) {
    std::uint64_t h = seed;
    for (const double c : {cell.x() + dx, cell.y() + dy, cell.z() + dz}) {
      h = mix(h, static_cast<std::uint64_t>(static_cast<std::int64_t>(c)));
    }
    return uniform(h);
  };
  double value = 0;
  for (int k = 0; k < 8; ++k) {
    const int dx = k & 1, dy = k >> 1 & 1, dz = k >> 2;
    value += (dx ? s.x() : 1 - s.x()) * (dy ? s.y() : 1 - s.y()) * (dz ? s.z() : 1 - s.z()) *
             corner(dx, dy, dz);
  }
  return value;
}

double fractal_noise(const Eigen::Vector3d& x, int octaves, std::uint64_t seed) {
  double sum = 0, weight = 1, total = 0, scale = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += weight * value_noise(scale * x, mix(seed, static_cast<std::uint64_t>(i)));
    total += weight;
    weight *= 0.5;
    scale *= 2;
  }
  return sum / total;
}

}  // namespace orbitfuse::synthetic
