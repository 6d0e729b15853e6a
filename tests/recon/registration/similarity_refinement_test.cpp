// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/similarity_refinement.hpp"

#include <gtest/gtest.h>

#include "tests/support/thermal_orbit.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::ThermalOrbit;

TEST(SimilarityRefinement, FindsWhatTheCloudsMissed) {
  const ThermalOrbit orbit;
  const Similarity3d off{
      1.02,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.04, Eigen::Vector3d(0, 1, 2).normalized())),
      {0.02, -0.01, 0.015}};
  const auto refined = refine_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                         off * orbit.visible_from_thermal, similarity_rounds(), {});
  ASSERT_TRUE(refined) << refined.error().message();
  EXPECT_TRUE(refined->improved);
  EXPECT_GT(refined->matches_after, refined->matches_before);
  const Similarity3d error = refined->visible_from_thermal * orbit.visible_from_thermal.inverse();
  EXPECT_NEAR(error.scale, 1, 0.004);
  EXPECT_LT(rotation_angle_deg(error.rotation, Eigen::Quaterniond::Identity()), 0.3);
  EXPECT_LT(error.translation.norm(), 0.01);
}

TEST(SimilarityRefinement, WhatIsRightStaysAndNothingToSeeIsRefused) {
  ThermalOrbit orbit;
  for (cv::Mat& image : orbit.images) image = cv::Scalar(295.15);
  const auto refined = refine_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                         orbit.visible_from_thermal, similarity_rounds(), {});
  ASSERT_TRUE(refined) << refined.error().message();
  EXPECT_FALSE(refined->improved);
  EXPECT_EQ(refined->visible_from_thermal.matrix(), orbit.visible_from_thermal.matrix());
}

TEST(SimilaritySupport, TellsHalfTurnsFromTheTruth) {
  const ThermalOrbit orbit;
  const auto support = [&](const Similarity3d& s) {
    const auto value =
        similarity_support(testing_orbit::box_renderer(), orbit.images, orbit.views, s, {});
    EXPECT_TRUE(value);
    return value.value_or(-1);
  };
  // As far off as clouds leave it, and the box stood on its other end.
  const Similarity3d off{
      1.01,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.03, Eigen::Vector3d(0, 1, 2).normalized())),
      {0.01, -0.01, 0.01}};
  const double right = support(off * orbit.visible_from_thermal);
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
    const Similarity3d half_turn{
        1, Eigen::Quaterniond(Eigen::AngleAxisd(EIGEN_PI, axis)), {0, 0, 0}};
    EXPECT_LT(support(off * half_turn * orbit.visible_from_thermal), 0.9 * right)
        << axis.transpose();
  }
}

TEST(SimilaritySupport, NothingToSeeSupportsNothing) {
  ThermalOrbit orbit;
  for (cv::Mat& image : orbit.images) image = cv::Scalar(295.15);
  const auto blank = similarity_support(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                        orbit.visible_from_thermal, {});
  ASSERT_TRUE(blank);
  EXPECT_EQ(*blank, 0);
  EXPECT_FALSE(similarity_support(testing_orbit::box_renderer(), {}, orbit.views, {}, {}));
}

TEST(SimilarityRefinement, CountsThatDifferAreAnInputError) {
  const ThermalOrbit orbit;
  const auto refined = refine_similarity(testing_orbit::box_renderer(), {}, orbit.views, {},
                                         similarity_rounds(), {});
  ASSERT_FALSE(refined);
  EXPECT_EQ(refined.error().kind, ErrorKind::input);
}

}  // namespace
}  // namespace orbitfuse
