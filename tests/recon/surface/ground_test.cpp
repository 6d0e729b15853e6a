// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/ground.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace orbitfuse {
namespace {

const Eigen::AlignedBox3d box{Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1)};

/// A height over the square that holds `half` either way, NaN: nothing there.
void add_heights(TriangleMesh& mesh, double half, const std::function<double(double, double)>& z) {
  constexpr int side = 120;
  std::vector<std::uint32_t> at(side * side, 0);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const double x = half * (2.0 * i / (side - 1) - 1), y = half * (2.0 * j / (side - 1) - 1);
      at[static_cast<std::size_t>(j * side + i)] =
          static_cast<std::uint32_t>(mesh.vertices.positions.size());
      mesh.vertices.positions.emplace_back(x, y, z(x, y));
    }
  const auto vertex = [&](int i, int j) { return at[static_cast<std::size_t>(j * side + i)]; };
  const auto here = [&](std::uint32_t v) { return mesh.vertices.positions[v].allFinite(); };
  for (int j = 0; j + 1 < side; ++j)
    for (int i = 0; i + 1 < side; ++i) {
      const auto a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1),
                 d = vertex(i, j + 1);
      if (!here(a) || !here(b) || !here(c) || !here(d)) continue;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
}

/// The upper half of a ball of 0.4.
double dome(double x, double y) {
  const double r = std::hypot(x, y);
  return r < 0.4 ? std::sqrt(0.16 - r * r) : std::nan("");
}

double ground_and_dome(double x, double y) {
  static std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.004);
  const double top = dome(x, y);
  return -0.2 + 0.1 * x + (std::isnan(top) ? 0 : top) + noise(random);
}

TEST(Ground, IsFoundUnderWhatStandsOnItAndLeftOut) {
  TriangleMesh mesh;
  add_heights(mesh, 1, ground_and_dome);
  const auto ground = find_ground(mesh, box, Eigen::Vector3d(0.05, 0, 1).normalized());
  ASSERT_TRUE(ground);
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.1, 0, 1).normalized();
  EXPECT_LT(std::acos(ground->normal.dot(normal)), 0.005);
  EXPECT_NEAR(ground->height, -0.2 * normal.z(), 0.002);
  EXPECT_NEAR(ground->sigma, 0.004, 0.002);

  const TriangleMesh object = without_ground(mesh, *ground, 0.02);
  ASSERT_FALSE(object.empty());
  double farthest = 0;
  for (const auto& t : object.triangles)
    for (const std::uint32_t v : t)
      farthest = std::max(farthest, mesh.vertices.positions[v].head<2>().norm());
  EXPECT_LT(farthest, 0.43) << "ground stays";
  const auto of_dome = static_cast<std::size_t>(std::count_if(
      mesh.triangles.begin(), mesh.triangles.end(), [&](const std::array<std::uint32_t, 3>& t) {
        return mesh.vertices.positions[t[0]].head<2>().norm() < 0.39;
      }));
  EXPECT_GT(object.triangles.size(), of_dome * 95 / 100) << "the object loses more than its foot";
}

TEST(Ground, ThereIsNoneWhereNothingGoesOnBeyondTheObject) {
  TriangleMesh hanging, on_a_plate, on_a_slope, above_a_floor;
  add_heights(hanging, 1, dome);
  EXPECT_FALSE(find_ground(hanging, box, Eigen::Vector3d::UnitZ()));
  // A turntable, half as wide as the box.
  add_heights(on_a_plate, 0.5, ground_and_dome);
  EXPECT_FALSE(find_ground(on_a_plate, box, Eigen::Vector3d::UnitZ()));
  // Twice as high as wide: 63 degrees.
  add_heights(on_a_slope, 0.5, [](double x, double y) { return 2 * x + 0.1 * y; });
  EXPECT_FALSE(find_ground(on_a_slope, box, Eigen::Vector3d::UnitZ()));
  // A table through whose middle the floor is seen.
  add_heights(above_a_floor, 1,
              [](double x, double y) { return std::hypot(x, y) < 0.5 ? -0.6 : 0.0; });
  EXPECT_FALSE(find_ground(above_a_floor, box, Eigen::Vector3d::UnitZ()));
  EXPECT_FALSE(find_ground({}, box, Eigen::Vector3d::UnitZ()));
}

}  // namespace
}  // namespace orbitfuse
