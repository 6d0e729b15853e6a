// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <numbers>
#include <random>

#include "core/geometry/point_cloud.hpp"
#include "core/geometry/transform.hpp"

namespace orbitfuse::testing {

using Random = std::mt19937;

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline Eigen::Vector3d gaussian3(Random& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return {x, y, z};
}
inline Eigen::Quaterniond any_rotation(Random& random) {
  const Eigen::Vector3d v = gaussian3(random);
  return Eigen::Quaterniond(std::normal_distribution<double>()(random), v.x(), v.y(), v.z())
      .normalized();
}
inline Similarity3d any_similarity(Random& random) {
  Similarity3d s;
  s.scale = uniform(random, 0.4, 2.5);
  s.rotation = any_rotation(random);
  s.translation = 3 * gaussian3(random);
  return s;
}

/// Points drawn one by one from a shape; count and seed fix them.
inline PointCloud drawn(int count, std::uint32_t seed,
                        const std::function<Eigen::Vector3d(Random&)>& draw) {
  Random random(seed);
  PointCloud cloud;
  for (int i = 0; i < count; ++i) cloud.positions.push_back(draw(random));
  return cloud;
}

inline Eigen::Vector3d on_sphere(Random& random) { return gaussian3(random).normalized(); }
inline Eigen::Vector3d on_cylinder(Random& random) {
  const double angle = uniform(random, 0, 2 * std::numbers::pi);
  return {std::cos(angle), std::sin(angle), uniform(random, -2, 2)};
}
inline Eigen::Vector3d on_cube(Random& random) {
  Eigen::Vector3d p(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
  const int face = std::uniform_int_distribution<int>(0, 5)(random);
  p[face / 2] = face % 2 ? 1 : -1;
  return p;
}
inline Eigen::Vector3d on_plane(Random& random) {
  return {uniform(random, -1, 1), uniform(random, -0.7, 0.7), 0.3};
}
inline Eigen::Vector3d on_line(Random& random) {
  return uniform(random, -1, 1) * Eigen::Vector3d(1, 2, 3);
}
/// A lopsided potato: no symmetry, all directions held.
inline Eigen::Vector3d on_potato(Random& random) {
  const Eigen::Vector3d u = on_sphere(random);
  const double bumps =
      1 + 0.25 * std::sin(3 * u.x() + 1) + 0.2 * std::cos(4 * u.y() * u.z()) + 0.15 * u.z() * u.x();
  return bumps * Eigen::Vector3d(1.6 * u.x(), 1.0 * u.y(), 0.8 * u.z());
}

inline PointCloud moved(PointCloud cloud, const Similarity3d& similarity) {
  for (auto& p : cloud.positions) p = similarity * p;
  return cloud;
}

}  // namespace orbitfuse::testing
