// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "drivers/synthetic/solid.hpp"

namespace orbitfuse::synthetic {

/// A warm car on asphalt with things lying about and buildings behind. Metres; z up; the ground is
/// z = 0; the car stands on the origin and looks along +x.
class Scene {
 public:
  explicit Scene(std::uint64_t seed);

  /// Nearest surface beyond min_distance; solid() of ground hits is the ground's.
  Hit intersect(const Ray& ray, double min_distance = 1e-4) const;
  bool is_shadowed(const Eigen::Vector3d& point) const;
  const Solid& solid(int index) const { return solids_[static_cast<std::size_t>(index)]; }
  std::uint64_t seed() const { return seed_; }

  static Eigen::Vector3d sun_direction();  ///< unit, towards the sun

 private:
  std::uint64_t seed_;
  std::vector<Solid> solids_;  ///< [0] stands for the ground plane
};

/// The car's parts.
std::vector<Solid> make_car(std::uint64_t seed);

}  // namespace orbitfuse::synthetic
