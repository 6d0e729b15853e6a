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

TEST(ChangedRegions, TheFootOfWhatCameBelongsToIt) {
  const TriangleMesh mesh = test::yard({test::house, test::crate}, 0.02);
  // The crate came: its lowest 4 cm are as near to the ground as what is the same may be.
  const auto of_crate = [](const Eigen::Vector3d& p) {
    return p.x() > test::crate.x - 0.001 && p.x() < test::crate.x + test::crate.width + 0.001 &&
           p.y() > test::crate.y - 0.001 && p.y() < test::crate.y + test::crate.depth + 0.001;
  };
  std::vector<SurfaceChange> change(mesh.vertices.size(), SurfaceChange::same);
  for (std::size_t i = 0; i < change.size(); ++i)
    if (of_crate(mesh.vertices.positions[i]) && mesh.vertices.positions[i].z() > 0.045)
      change[i] = SurfaceChange::changed;
  ComparisonOptions options;
  options.least_region_area = 1e-3;
  change[0] = SurfaceChange::changed;  // a single vertex has no foot
  const auto came = changed_regions(mesh, change, options);
  ASSERT_EQ(came.size(), 5U);  // faces share no vertices
  add_feet(mesh, came, options, change);
  int foot = 0, elsewhere = 0;
  for (std::size_t i = 1; i < change.size(); ++i) {
    const Eigen::Vector3d& p = mesh.vertices.positions[i];
    if (of_crate(p) && p.z() > 0.001) {
      ++foot;
      EXPECT_EQ(change[i], SurfaceChange::changed) << p.transpose();
    } else if (!of_crate(p)) {
      elsewhere += change[i] == SurfaceChange::changed &&
                   (p.head<2>() - Eigen::Vector2d(-0.8, 1.4)).cwiseAbs().maxCoeff() > 0.26;
    }
  }
  EXPECT_GT(foot, 100);
  EXPECT_EQ(elsewhere, 0);
  add_feet(mesh, {}, options, change);  // nothing came: nothing to do
}

}  // namespace
}  // namespace orbitfuse::comparison
