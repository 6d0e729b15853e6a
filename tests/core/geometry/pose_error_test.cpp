// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/pose_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace orbitfuse {
namespace {

/// Cameras on a circle, seen from a world that differs by a similarity.
std::vector<PosePair> orbit(int count, const Similarity3d& estimate_from_truth) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(a, Eigen::Vector3d(0.2, 1, 0.1).normalized()));
    const Eigen::Vector3d center(3 * std::cos(a), 3 * std::sin(a), 0.2 * (i % 3));
    const Rigid3d truth{q, -(q * center)};
    pairs.push_back({rebase(truth, estimate_from_truth), truth});
  }
  return pairs;
}

const Similarity3d moved{
    0.37,
    Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, 2, 3).normalized())),
    {4, -5, 60}};

TEST(PoseError, SimilarityIsRecoveredAndErrorsVanish) {
  const auto pairs = orbit(12, moved);
  const auto fit = truth_from_estimate(pairs);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->scale, 1 / 0.37, 1e-9);
  const PoseError error = pose_error(pairs, *fit);
  EXPECT_EQ(error.views, 12);
  EXPECT_LT(error.ate_percent, 1e-7);
  EXPECT_LT(error.rotation_max_deg, 1e-5);
}

TEST(PoseError, OneTurnedCameraShowsInTheMaximumOnly) {
  auto pairs = orbit(12, moved);
  Rigid3d& cam = pairs[3].cam_from_estimate;
  const Eigen::Vector3d center = camera_center(cam);
  cam.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 18, Eigen::Vector3d::UnitX())) *
      cam.rotation;
  cam.translation = -(cam.rotation * center);
  const PoseError error = pose_error(pairs, *truth_from_estimate(pairs));
  EXPECT_NEAR(error.rotation_max_deg, 10, 1e-6);
  EXPECT_NEAR(error.rotation_mean_deg, 10.0 / 12, 1e-6);
  EXPECT_LT(error.rotation_median_deg, 1e-5);
  ASSERT_EQ(error.each.size(), 12u);
  EXPECT_NEAR(error.each[3].rotation_deg, 10, 1e-6);
  EXPECT_LT(error.ate_percent, 1e-7);
}

TEST(PoseError, AteIsInPercentOfTheExtent) {
  auto pairs = orbit(12, {});
  EXPECT_NEAR(extent_of_truth(pairs), 6, 0.05);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    // Up and down in turn: no similarity explains it.
    const Eigen::Vector3d shift(0, 0, i % 2 ? 0.06 : -0.06);
    Rigid3d& cam = pairs[i].cam_from_estimate;
    cam.translation = -(cam.rotation * (camera_center(cam) + shift));
  }
  EXPECT_NEAR(pose_error(pairs, *truth_from_estimate(pairs)).ate_percent, 1.0, 0.05);
}

TEST(PoseError, EachViewSaysHowFarAndWhichWay) {
  auto pairs = orbit(12, moved);
  pairs[5].name = "005";
  // Backwards along its own axis by 1 of the extent's 6, in the estimate's units.
  pairs[5].cam_from_estimate.translation.z() += 0.37;
  const PoseError error = pose_error(pairs, moved.inverse());
  const double percent = 100 / extent_of_truth(pairs);
  EXPECT_EQ(error.each[5].name, "005");
  EXPECT_NEAR(error.each[5].center_percent, percent, 1e-6);
  EXPECT_NEAR(error.each[5].outward_percent, percent, 1e-6);
  EXPECT_NEAR(error.ate_max_percent, percent, 1e-6);
  EXPECT_LT(error.ate_median_percent, 1e-6);
}

TEST(PoseError, UndeterminedFitsAreErrors) {
  EXPECT_FALSE(truth_from_estimate({}));
  EXPECT_FALSE(truth_from_estimate(orbit(2, {})));
  std::vector<PosePair> line;
  for (int i = 0; i < 5; ++i) {
    const Rigid3d cam{Eigen::Quaterniond::Identity(), Eigen::Vector3d(-i, 0, 0)};
    line.push_back({cam, cam});
  }
  EXPECT_FALSE(truth_from_estimate(line));
  EXPECT_FALSE(truth_from_estimate(std::vector<PosePair>(5, line[0])));
}

}  // namespace
}  // namespace orbitfuse
