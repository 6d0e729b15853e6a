// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/thermal_bundle.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "core/system/parallel.hpp"
#include "tests/support/thermal_ball.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::Ball;

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

TEST(ThermalBundle, ACommonErrorOfFocalLengthAndDistanceGoes) {
  Ball ball;
  ball.shorten(0.012, 0.1);
  ASSERT_TRUE(ball.bundle());
  EXPECT_NEAR(ball.focal_error(), 0, 0.004);
  for (std::size_t i = 0; i < ball.truth.size(); ++i) {
    EXPECT_LT(ball.center_error(i), 0.006 * 2.5) << i;
    EXPECT_GT(ball.alignment.views[i].confirmed_patches.value_or(0), 50) << i;
    EXPECT_DOUBLE_EQ(ball.alignment.views[i].view.camera.fx, ball.alignment.focal_px);
  }
}

TEST(ThermalBundle, AViewElsewhereComesHome) {
  Ball ball;
  OrbitPose elsewhere;
  elsewhere.azimuth_deg = 30 * 4 + 6, elsewhere.elevation_deg = 20, elsewhere.radius = 2.5;
  PosedView& wrong = ball.alignment.views[4].view;
  wrong.cam_from_world = cam_from_world_of(elsewhere, wrong.camera);
  ASSERT_GT(ball.center_error(4), 0.2);
  ASSERT_TRUE(ball.bundle());
  for (std::size_t i = 0; i < ball.truth.size(); ++i)
    EXPECT_LT(ball.center_error(i), 0.007 * 2.5) << i;
}

TEST(ThermalBundle, AViewOfSomethingElseIsConfirmedByNobodyAndMovesNobody) {
  Ball ball;
  ball.orbit.images[4] = ball.orbit.images[9];
  ASSERT_TRUE(ball.bundle());
  EXPECT_LT(ball.alignment.views[4].confirmed_patches.value(),
            0.2 * ball.alignment.views[8].confirmed_patches.value());
  for (std::size_t i = 0; i < ball.truth.size(); ++i)
    EXPECT_LT(i == 4 ? 0 : ball.center_error(i), 0.006 * 2.5) << i;
}

TEST(ThermalBundle, ALensThatBendsIsFoundOut) {
  for (const double k1 : {-0.2, 0.1}) {
    Ball ball;
    ball.bend(k1);
    ball.shorten(0.005, 0.1);
    ASSERT_TRUE(ball.bundle(0.2));
    EXPECT_NEAR(ball.alignment.radial, k1, 0.03);
    EXPECT_NEAR(ball.focal_error(), 0, 0.005) << k1;
    for (std::size_t i = 0; i < ball.truth.size(); ++i)
      EXPECT_LT(ball.center_error(i), 0.008 * 2.5) << k1 << ", " << i;
  }
  Ball calibrated(8);
  ASSERT_TRUE(calibrated.bundle());
  EXPECT_EQ(calibrated.alignment.radial, 0);
  Ball straight(8);
  ASSERT_TRUE(straight.bundle(0.2));
  EXPECT_EQ(straight.alignment.radial, 0) << "too little to show is none";
}

TEST(ThermalBundle, TheAnswerIsTheSameOnAnyNumberOfThreads) {
  Ball one(8), four(8);
  one.shorten(0.01, 0.1), four.shorten(0.01, 0.1);
  const int usual = thread_count();
  set_thread_count(1);
  const Status alone = one.bundle();
  set_thread_count(4);
  const Status together = four.bundle();
  set_thread_count(usual);
  ASSERT_TRUE(alone && together);
  for (std::size_t i = 0; i < one.truth.size(); ++i)
    EXPECT_EQ(one.alignment.views[i].view.cam_from_world.translation,
              four.alignment.views[i].view.cam_from_world.translation);
}

TEST(ThermalBundle, WithoutAnythingToFindNothingMoves) {
  for (const float value : {0.0F, nothing, 1e30F}) {
    Ball ball(6);
    for (cv::Mat& image : ball.orbit.images) image.setTo(value);
    ball.shorten(0.012, 0.1);
    const Fit before = ball.alignment;
    ASSERT_TRUE(ball.bundle());
    EXPECT_EQ(ball.alignment.focal_px, before.focal_px);
    for (std::size_t i = 0; i < before.views.size(); ++i) {
      EXPECT_EQ(ball.alignment.views[i].view.cam_from_world.translation,
                before.views[i].view.cam_from_world.translation);
      EXPECT_FALSE(ball.alignment.views[i].confirmed_patches);
    }
  }
  Ball blind(6);
  blind.form = [](const Camera& camera, const Rigid3d&) -> Result<SceneRender> {
    return SceneRender{cv::Mat(camera.height, camera.width, CV_32F, cv::Scalar(0)),
                       cv::Mat(camera.height, camera.width, CV_32F, cv::Scalar(nothing))};
  };
  ASSERT_TRUE(blind.bundle());
  EXPECT_EQ(blind.focal_error(), 0);
  Ball none(0);
  EXPECT_TRUE(none.bundle());
}

TEST(ThermalBundle, DeadPixelsBlindNobody) {
  Ball ball;
  for (cv::Mat& image : ball.orbit.images)
    for (int x = 5; x < 320; x += 40) image.at<float>(3, x) = nothing;
  ball.orbit.images[2].at<float>(120, 160) = nothing;
  ASSERT_TRUE(ball.bundle());
  for (const RenderAlignedView& view : ball.alignment.views)
    EXPECT_GT(view.confirmed_patches.value_or(0), 50) << view.view.name;
}

TEST(ThermalBundle, DroppedViewsLendNothing) {
  Ball ball;
  ball.alignment.views[3].verdict = {Confidence::dropped, DoubtReason::not_found, ""};
  ASSERT_TRUE(ball.bundle());
  EXPECT_FALSE(ball.alignment.views[3].confirmed_patches);
  EXPECT_GT(ball.alignment.views[2].confirmed_patches.value_or(0), 50);
  EXPECT_LT(ball.center_error(3), 0.03 * 2.5) << "edges alone hold it";
}

TEST(BundleAdded, AddedViewsComeHomeAndNobodyElseMoves) {
  Ball ball;
  const auto put_elsewhere = [&](std::size_t i, double by_deg) {
    OrbitPose elsewhere;
    elsewhere.azimuth_deg = 30.0 * static_cast<double>(i) + by_deg;
    elsewhere.elevation_deg = 20, elsewhere.radius = 2.5;
    PosedView& wrong = ball.alignment.views[i].view;
    wrong.cam_from_world = cam_from_world_of(elsewhere, wrong.camera);
  };
  put_elsewhere(4, 6);
  put_elsewhere(8, -4);
  put_elsewhere(2, 5);                           // nobody asks it to move
  ball.orbit.images[10] = ball.orbit.images[5];  // of somewhere else
  ball.alignment.radial = 0.07;                  // images are straightened already
  const Fit before = ball.alignment;
  const std::vector<std::size_t> added{4, 8, 10}, settled{0, 1, 3, 5, 6, 7, 9, 11};
  ASSERT_TRUE(
      bundle_added({ball.form, ball.orbit, ball.progress}, added, settled, {}, ball.alignment));
  EXPECT_LT(ball.center_error(4), 0.007 * 2.5);
  EXPECT_LT(ball.center_error(8), 0.007 * 2.5);
  const auto confirmed = [&](std::size_t i) {
    return ball.alignment.views[i].confirmed_patches.value_or(-1);
  };
  EXPECT_GT(confirmed(4), 50);
  EXPECT_LT(confirmed(10), 0.2 * confirmed(8));
  for (const std::size_t i : {0u, 1u, 2u, 3u, 5u, 6u, 7u, 9u, 11u}) {
    EXPECT_EQ(ball.alignment.views[i].view.cam_from_world.translation,
              before.views[i].view.cam_from_world.translation)
        << i;
    EXPECT_EQ(confirmed(i), -1) << i;
  }
  EXPECT_EQ(ball.alignment.radial, 0.07);
  EXPECT_EQ(ball.alignment.views[4].view.camera.fx, before.focal_px);
}

TEST(ThermalBundle, ARendererThatFailsIsPassedOn) {
  Ball ball;
  ball.form = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "cut", "train again");
  };
  const Status status = ball.bundle();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().where, "field");
}

}  // namespace
}  // namespace orbitfuse
