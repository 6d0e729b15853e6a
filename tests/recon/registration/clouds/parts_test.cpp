// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "recon/registration/clouds/features.hpp"
#include "recon/registration/clouds/match_consensus.hpp"
#include "recon/registration/clouds/outlier_filter.hpp"
#include "recon/registration/clouds/prepared_cloud.hpp"
#include "recon/registration/clouds/rotation_grid.hpp"
#include "recon/registration/clouds/thinning.hpp"
#include "tests/recon/registration/shapes.hpp"

namespace orbitfuse::registration {
namespace {

using namespace orbitfuse::testing;

TEST(NearestTable, AgreesWithBruteForceNearTheSurface) {
  const auto cloud = prepare(drawn(2500, 1, on_potato), {}, "cloud");
  ASSERT_TRUE(cloud);
  Random random(3);
  int exact = 0;
  for (int i = 0; i < 500; ++i) {
    const auto& anchor = cloud->points[std::uniform_int_distribution<std::size_t>(
        0, cloud->points.size() - 1)(random)];
    const Eigen::Vector3d x = anchor + 0.03 * gaussian3(random);
    double least = 1e9;
    for (const auto& p : cloud->points) least = std::min(least, (p - x).norm());
    const auto found = cloud->nearest(x);
    ASSERT_TRUE(found);
    const double d = (cloud->points[*found] - x).norm();
    exact += d < least + 1e-12;
    EXPECT_LT(d, least + cloud->nearest_table.cell());
  }
  EXPECT_GT(exact, 490);
  EXPECT_FALSE(cloud->nearest({1e3, 0, 0}));
  EXPECT_FALSE(cloud->nearest({1e30, -1e30, 0}));
}

TEST(Prepare, NormalsOfASpherePointOutwards) {
  const auto cloud = prepare(drawn(2500, 1, on_sphere), {}, "cloud");
  ASSERT_TRUE(cloud);
  for (std::size_t i = 0; i < cloud->points.size(); ++i) {
    EXPECT_GT(cloud->normals[i].dot(cloud->points[i].normalized()), 0.95);
  }
}

TEST(Thinning, KeepsAtMostTheWantedCountAndDropsDuplicates) {
  Points points = drawn(5000, 1, on_potato).positions;
  const Points some = thinned_to(points, 1000);
  EXPECT_LE(some.size(), 1000u);
  EXPECT_GT(some.size(), 800u);
  Points repeated;
  for (int i = 0; i < 20; ++i)
    repeated.insert(repeated.end(), points.begin(), points.begin() + 300);
  EXPECT_EQ(thinned_to(repeated, 1000).size(), 300u);
}

TEST(OutlierFilter, LeavesCleanAndNoisySurfacesAlone) {
  for (const double noise : {0.0, 0.01, 0.02}) {
    Random random(5);
    Points points = drawn(3000, 4, on_potato).positions;
    for (auto& p : points) p = 0.7 * p + noise * gaussian3(random);
    EXPECT_EQ(without_outliers(points).size(), points.size()) << noise;
  }
}

TEST(OutlierFilter, KeepsTheSparseHalfOfASurface) {
  Points points = drawn(4000, 4, on_potato).positions;
  std::size_t i = 0;
  std::erase_if(points, [&](const Eigen::Vector3d& p) { return p.x() > 0 && i++ % 6 != 0; });
  EXPECT_EQ(without_outliers(points).size(), points.size());
}

TEST(OutlierFilter, DropsMostScatteredPoints) {
  for (const int scattered : {1000, 5000}) {
    Random random(6);
    Points points = drawn(1250, 4, on_potato).positions;
    for (auto& p : points) p *= 0.7;
    for (int k = 0; k < scattered; ++k) {
      points.push_back(
          {uniform(random, -1.5, 1.5), uniform(random, -1.2, 1.2), uniform(random, -1, 1)});
    }
    const Points kept = without_outliers(points);
    const Points surface(points.begin(), points.begin() + 1250);
    std::size_t right = 0;
    for (const auto& p : kept)
      right += std::find(surface.begin(), surface.end(), p) != surface.end();
    EXPECT_GT(static_cast<double>(right), 0.8 * 1250) << scattered;
    EXPECT_GT(static_cast<double>(right), 0.5 * static_cast<double>(kept.size())) << scattered;
  }
}

TEST(Descriptors, DoNotChangeWithTheFrame) {
  const auto cloud = prepare(drawn(2500, 1, on_potato), {}, "cloud");
  ASSERT_TRUE(cloud);
  FeaturePoints a = feature_points(*cloud, 500), b = a;
  Random random(7);
  const Eigen::Quaterniond turn = any_rotation(random);
  for (auto& p : b.points) p = turn * p + Eigen::Vector3d(1, 2, 3);
  for (auto& n : b.normals) n = turn * n;
  EXPECT_LT((describe(a, 0.35) - describe(b, 0.35)).cwiseAbs().maxCoeff(), 2e-3);
  const auto matches = mutual_matches(describe(a, 0.35), describe(b, 0.35), 500);
  EXPECT_GT(matches.size(), 450u);
}

TEST(Consensus, FindsTheSimilarityAmongWrongMatches) {
  const auto cloud = prepare(drawn(2500, 1, on_potato), {}, "cloud");
  ASSERT_TRUE(cloud);
  const FeaturePoints a = feature_points(*cloud, 300);
  FeaturePoints b = a;
  Random random(8);
  Similarity3d truth;
  truth.rotation = any_rotation(random);
  truth.scale = 1.1;
  for (auto& p : b.points) p = truth * p;
  for (auto& n : b.normals) n = truth.rotation * n;
  std::vector<Match> matches;
  for (int i = 0; i < 200; ++i) {
    const int other =
        std::uniform_int_distribution<int>(0, static_cast<int>(b.points.size()) - 1)(random);
    matches.push_back({i, i % 8 == 0 ? i : other, 0.1f});
  }
  const Candidates found = consensus_candidates(a, b, matches, 1.0, 5);
  ASSERT_FALSE(found.empty());
  EXPECT_LT(rotation_angle_deg(found[0].target_from_source.rotation, truth.rotation), 1);
  EXPECT_NEAR(found[0].target_from_source.scale, 1.1, 0.02);
}

TEST(RotationSpiral, LeavesNoRotationFarAway) {
  const auto grid = rotation_spiral(600);
  Random random(9);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Quaterniond q = any_rotation(random);
    double least = 180;
    for (const auto& g : grid) least = std::min(least, rotation_angle_deg(q, g));
    EXPECT_LT(least, 32);
  }
}

}  // namespace
}  // namespace orbitfuse::registration
