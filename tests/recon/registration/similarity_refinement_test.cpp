// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/similarity_refinement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/image/undistorted.hpp"
#include "tests/support/thermal_orbit.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::ThermalOrbit;

Camera with_k1(Camera camera, double k1) {
  camera.k1 = k1;
  return camera;
}

void expect_comes_home(const ThermalOrbit& orbit) {
  const Similarity3d off{
      1.02,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.04, Eigen::Vector3d(0, 1, 2).normalized())),
      {0.02, -0.01, 0.015}};
  const auto refined = refine_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                         off * orbit.visible_from_thermal, similarity_rounds(), {});
  ASSERT_TRUE(refined) << refined.error().message();
  EXPECT_TRUE(refined->improved);
  EXPECT_FALSE(refined->unseen);
  EXPECT_GT(refined->matches_after, refined->matches_before);
  const Similarity3d error = refined->visible_from_thermal * orbit.visible_from_thermal.inverse();
  EXPECT_NEAR(error.scale, 1, 0.004);
  EXPECT_LT(rotation_angle_deg(error.rotation, Eigen::Quaterniond::Identity()), 0.3);
  EXPECT_LT(error.translation.norm(), 0.01);
}

TEST(SimilarityRefinement, FindsWhatTheCloudsMissed) { expect_comes_home(ThermalOrbit()); }

TEST(SimilarityRefinement, ABentLensGivesTheSameOnceStraightened) {
  ThermalOrbit orbit;
  for (std::size_t i = 0; i < orbit.views.size(); ++i) {
    PosedView& view = orbit.views[i];
    const Camera bent = with_k1(view.camera, -0.2);
    orbit.images[i] = undistorted(orbit.images[i], view.camera, bent);
    view.camera = bent;
    ASSERT_TRUE(straighten(orbit.images[i], view));
  }
  expect_comes_home(orbit);
}

TEST(Straighten, GivesWhatAStraightCameraSees) {
  const Camera straight = testing_orbit::camera().scaled_to(320, 240);
  const Camera bent = with_k1(straight, -0.2);
  // Each pixel holds the column in which the straight camera sees it.
  cv::Mat image(bent.height, bent.width, CV_32F);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<float>(y, x) =
          static_cast<float>(straight.pixel_of(bent.normalized_of({x + 0.5, y + 0.5})).x());
  ASSERT_GT(std::abs(image.at<float>(0, 0) - 0.5F), 3) << "hardly bent: this shows nothing";
  image.at<float>(120, 160) = std::numeric_limits<float>::quiet_NaN();
  PosedView view{"view", bent, {}};
  ASSERT_TRUE(straighten(image, view));
  EXPECT_EQ(view.camera, straight);
  int without_value = 0;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const float seen = image.at<float>(y, x);
      without_value += !std::isfinite(seen);
      if (std::isfinite(seen)) {
        ASSERT_NEAR(seen, static_cast<float>(x) + 0.5F, 0.06) << x << ", " << y;
      }
    }
  EXPECT_GE(without_value, 1);
  EXPECT_LE(without_value, 9);
}

TEST(Straighten, LeavesWhatIsStraightAndRefusesOtherSizes) {
  const Camera straight = testing_orbit::camera().scaled_to(320, 240);
  const cv::Mat image(240, 320, CV_32F, cv::Scalar(295.15));
  cv::Mat same = image;
  PosedView view{"view", straight, {}};
  ASSERT_TRUE(straighten(same, view));
  EXPECT_EQ(same.data, image.data);
  EXPECT_EQ(view.camera, straight);
  cv::Mat small(120, 160, CV_32F, cv::Scalar(295.15));
  const Status refused = straighten(small, view);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::input);
  EXPECT_EQ(refused.error().where, "view");
}

TEST(SimilarityRefinement, WhatIsRightStaysAndNothingToSeeIsRefused) {
  ThermalOrbit orbit;
  for (cv::Mat& image : orbit.images) image = cv::Scalar(295.15);
  const auto refined = refine_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                         orbit.visible_from_thermal, similarity_rounds(), {});
  ASSERT_TRUE(refined) << refined.error().message();
  EXPECT_FALSE(refined->improved);
  EXPECT_TRUE(refined->unseen);
  EXPECT_EQ(refined->visible_from_thermal.matrix(), orbit.visible_from_thermal.matrix());
}

TEST(SimilarityRefinement, ImagesThatOnlyConfirmSeeTheAnswerAllTheSame) {
  const ThermalOrbit orbit;
  const auto refined = refine_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                                         orbit.visible_from_thermal, {}, {});
  ASSERT_TRUE(refined) << refined.error().message();
  EXPECT_FALSE(refined->improved);
  EXPECT_FALSE(refined->unseen);
}

TEST(SimilarityRefinement, ImagesThatLookPastTheSceneDontSeeTheAnswer) {
  const ThermalOrbit orbit;
  const Similarity3d above{1, Eigen::Quaterniond::Identity(), {0, 0, 100}};
  const auto refined =
      refine_similarity(testing_orbit::box_renderer(), orbit.images, orbit.views,
                        above * orbit.visible_from_thermal, similarity_rounds(), {});
  ASSERT_TRUE(refined) << refined.error().message();
  EXPECT_FALSE(refined->improved);
  EXPECT_TRUE(refined->unseen);
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
