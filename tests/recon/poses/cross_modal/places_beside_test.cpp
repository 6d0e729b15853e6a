// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/places_beside.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/support/thermal_ball.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::Ball;

void put_beside(Ball& ball, std::size_t i, double azimuth_deg, double elevation_deg) {
  OrbitPose beside;
  beside.azimuth_deg = 30.0 * static_cast<double>(i) + azimuth_deg;
  beside.elevation_deg = (i % 2 == 0 ? 20 : 32) + elevation_deg, beside.radius = 2.5;
  PosedView& view = ball.alignment.views[i].view;
  view.cam_from_world = cam_from_world_of(beside, view.camera);
}

Result<int> tried(Ball& ball) {
  return try_places_beside({ball.form, ball.orbit, ball.progress}, ball.alignment);
}

void expect_unmoved(const Ball& ball, const Fit& before, const std::vector<std::size_t>& views) {
  for (const std::size_t i : views)
    EXPECT_EQ(ball.alignment.views[i].view.cam_from_world.translation,
              before.views[i].view.cam_from_world.translation)
        << i;
}

TEST(PlacesBeside, AViewComesHomeAndNobodyElseMoves) {
  Ball ball;
  put_beside(ball, 4, 1.4, 0);
  put_beside(ball, 7, 0, -1.4);
  const Fit before = ball.alignment;
  const auto went = tried(ball);
  ASSERT_TRUE(went) << went.error().message();
  EXPECT_EQ(*went, 2);
  for (const std::size_t i : {4u, 7u}) EXPECT_LT(ball.center_error(i), 0.007 * 2.5) << i;
  expect_unmoved(ball, before, {0, 1, 2, 3, 5, 6, 8, 9, 10, 11});
}

TEST(PlacesBeside, RightViewsAndDroppedOnesStay) {
  Ball ball;
  put_beside(ball, 4, 1.4, 0);
  ball.alignment.views[4].verdict = {Confidence::dropped, DoubtReason::not_found, ""};
  const Fit before = ball.alignment;
  EXPECT_EQ(tried(ball).value(), 0);
  expect_unmoved(ball, before, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
}

TEST(PlacesBeside, WhereFormSaysLessNobodyGoes) {
  Ball ball;
  put_beside(ball, 4, 1.4, 0);
  const Eigen::Vector3d home = camera_center(ball.truth[4].cam_from_world);
  ball.form = [home](const Camera& camera, const Rigid3d& pose) -> Result<SceneRender> {
    SceneRender seen = testing_orbit::ball_view(camera, pose, false);
    if ((camera_center(pose) - home).norm() < 0.03) seen.brightness.setTo(1);
    return seen;
  };
  const Fit before = ball.alignment;
  EXPECT_EQ(tried(ball).value(), 0);
  expect_unmoved(ball, before, {4});
}

TEST(PlacesBeside, WithoutAnythingToCompareNothingMoves) {
  for (const float value : {0.0F, std::numeric_limits<float>::quiet_NaN(), 1e30F}) {
    Ball ball(6);
    for (cv::Mat& image : ball.orbit.images) image.setTo(value);
    EXPECT_EQ(tried(ball).value(), 0) << value;
  }
  for (const int few : {0, 1, 2}) {
    Ball ball(few);
    EXPECT_EQ(tried(ball).value(), 0) << few;
  }
}

TEST(PlacesBeside, ARendererThatFailsIsPassedOn) {
  Ball ball;
  ball.form = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "cut", "train again");
  };
  const auto went = tried(ball);
  ASSERT_FALSE(went);
  EXPECT_EQ(went.error().where, "field");
}

}  // namespace
}  // namespace orbitfuse
