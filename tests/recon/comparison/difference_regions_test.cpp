// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/difference_regions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/recon/comparison/yard.hpp"

namespace orbitfuse::comparison {
namespace {
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Differences over the ground: `inside` within half a metre of x, y, else `outside`.
std::vector<PointDifference> warm_patch(const TriangleMesh& mesh, double x, double y, double inside,
                                        double outside, double uncertainty = 0.8) {
  std::vector<PointDifference> points;
  for (const Eigen::Vector3d& p : mesh.vertices.positions) {
    const bool in = std::hypot(p.x() - x, p.y() - y) < 0.5;
    points.push_back({in ? inside : outside, uncertainty, 300, 300});
  }
  return points;
}

TEST(DifferenceRegions, AWarmPatchIsOneRegionWithPlaceAndArea) {
  const TriangleMesh mesh = test::yard({});
  auto points = warm_patch(mesh, 1, -1, 5, 0.1);
  points[0].difference_k = 30;  // one vertex is no region
  const auto regions = difference_regions(mesh, points, 0, {});
  ASSERT_EQ(regions.size(), 1U);
  EXPECT_DOUBLE_EQ(regions[0].difference_k, 5);
  EXPECT_DOUBLE_EQ(regions[0].uncertainty_k, 0.8);
  EXPECT_NEAR(regions[0].area, 3.14159 * 0.25, 0.1);
  EXPECT_LT((regions[0].middle - Eigen::Vector3d(1, -1, 0)).norm(), 0.05);
}

TEST(DifferenceRegions, TheCommonDifferenceIsTakenOut) {
  const TriangleMesh mesh = test::yard({});
  const auto points = warm_patch(mesh, 0, 0, 5, 2);
  const auto common = common_difference(mesh, points);
  ASSERT_TRUE(common);
  EXPECT_DOUBLE_EQ(*common, 2);
  EXPECT_EQ(difference_regions(mesh, points, 0, {}).size(), 1U);  // all of it is warmer
  const auto regions = difference_regions(mesh, points, *common, {});
  ASSERT_EQ(regions.size(), 1U);
  EXPECT_DOUBLE_EQ(regions[0].difference_k, 3);
  EXPECT_NEAR(regions[0].area, 3.14159 * 0.25, 0.1);
}

TEST(DifferenceRegions, WhatIsUnsureOrUnknownIsNoFinding) {
  const TriangleMesh mesh = test::yard({});
  EXPECT_TRUE(difference_regions(mesh, warm_patch(mesh, 0, 0, 5, 0, 6), 0, {}).empty());
  EXPECT_TRUE(difference_regions(mesh, warm_patch(mesh, 0, 0, nan, 0), 0, {}).empty());
  EXPECT_TRUE(difference_regions(mesh, warm_patch(mesh, 0, 0, nan, nan, nan), 0, {}).empty());
  EXPECT_FALSE(common_difference(mesh, warm_patch(mesh, 0, 0, nan, nan)));
  EXPECT_TRUE(difference_regions({}, {}, 0, {}).empty());
  EXPECT_FALSE(common_difference({}, {}));
  // Fewer differences than vertices: the others have none.
  EXPECT_TRUE(difference_regions(mesh, {}, 0, {}).empty());
}

TEST(DifferenceRegions, WarmerAndColderNeighboursAreTwo) {
  const TriangleMesh mesh = test::yard({});
  std::vector<PointDifference> points;
  for (const Eigen::Vector3d& p : mesh.vertices.positions)
    points.push_back({p.x() > 0 ? 4.0 : -6.0, 0.5, 300, 300});
  const auto regions = difference_regions(mesh, points, 0, {});
  ASSERT_EQ(regions.size(), 2U);
  EXPECT_DOUBLE_EQ(regions[0].difference_k, -6);
  EXPECT_DOUBLE_EQ(regions[1].difference_k, 4);
}

TEST(ChangedRegions, LargestFirst) {
  const TriangleMesh mesh = test::yard({test::house, test::crate});
  std::vector<SurfaceChange> change;
  for (const Eigen::Vector3d& p : mesh.vertices.positions)
    change.push_back(p.z() > 0.05 ? SurfaceChange::changed : SurfaceChange::same);
  const auto regions = changed_regions(mesh, change, {});
  ASSERT_GE(regions.size(), 2U);
  EXPECT_GT(regions[0].area, regions.back().area);
  EXPECT_TRUE(changed_regions(mesh, {}, {}).empty());
}

}  // namespace
}  // namespace orbitfuse::comparison
