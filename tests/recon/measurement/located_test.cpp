// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/located.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/recon/measurement/box_orbit.hpp"

namespace orbitfuse::measurement {
namespace {
using ::testing::HasSubstr;
using testing_orbit::box_view;

/// The box, its depth `share` too far in every other view, by the side that it is seen from.
SurfaceSource box_surface(double share = 0) {
  SurfaceSource source;
  source.views = testing_orbit::two_loops(2);
  source.depth = [share](const Camera& camera, const Rigid3d& pose,
                         const Progress&) -> Result<cv::Mat> {
    const Eigen::Vector3d eye = camera_center(pose);
    const bool off = static_cast<int>(std::floor(std::atan2(eye.y(), eye.x()) * 6)) % 2 != 0;
    return cv::Mat(box_view(camera, pose, true).depth * (off ? 1 + share : 1));
  };
  return source;
}

/// Where the box is at a pixel of a view.
Eigen::Vector3d truth(const PosedView& view, int x, int y) {
  const cv::Mat depth = box_view(view.camera, view.cam_from_world, true).depth;
  return view.cam_from_world.inverse() *
         (static_cast<double>(depth.at<float>(y, x)) * view.camera.ray_of({x + 0.5, y + 0.5}));
}

TEST(Located, APixelIsWhereTheSurfaceIs) {
  const SurfaceSource source = box_surface();
  int sure = 0;
  for (const PosedView& view : source.views) {
    const auto place = located(source, view, {320.5, 240.5}, {});
    ASSERT_TRUE(place) << place.error().message();
    EXPECT_LT((place->position - truth(view, 320, 240)).norm(), 0.005);
    EXPECT_GT(place->across, 0);
    sure += place->along < 0.05;
  }
  EXPECT_GE(sure, 18);  // the others look at an edge, past which some views see
}

TEST(Located, ViewsThatAreApartMakeItLessSureNotWrong) {
  const SurfaceSource even = box_surface(), apart = box_surface(0.06);
  int covered = 0;
  double sure = 0, unsure = 0;
  for (const PosedView& view : apart.views) {
    const auto place = located(apart, view, {320.5, 240.5}, {});
    ASSERT_TRUE(place) << place.error().message();
    covered += (place->position - truth(view, 320, 240)).norm() <= 1.645 * place->along;
    unsure += place->along;
    sure += located(even, view, {320.5, 240.5}, {})->along;
  }
  EXPECT_GE(covered, 22);
  EXPECT_GT(unsure, 2 * sure);
}

TEST(Located, APointIsKeptAndAsUnsureAsTheViewsAreApart) {
  const SurfaceSource even = box_surface(), apart = box_surface(0.06);
  const Eigen::Vector3d point = truth(even.views[0], 320, 240);
  const auto sure = located(even, point, 2, {}), unsure = located(apart, point, 2, {});
  ASSERT_TRUE(sure && unsure);
  EXPECT_EQ(sure->position, point);
  EXPECT_EQ(unsure->position, point);
  EXPECT_GE(sure->along, 0.004);
  EXPECT_GT(unsure->along, 5 * sure->along);
  // In the air, where no view has a surface, and before any view is known: what a reading costs.
  EXPECT_DOUBLE_EQ(located(even, {0, 0, 1.2}, 2, {})->along, 0.004);
  EXPECT_DOUBLE_EQ(located({even.depth, {}}, point, 2, {})->along, 0.004);
  EXPECT_TRUE(sure->confirmed);
  EXPECT_FALSE(located(even, {0, 0, 1.2}, 2, {})->confirmed);
  EXPECT_TRUE(std::isnan(located(even, {0, 0, 1.2}, std::nan(""), {})->along));
}

TEST(Located, WhatIsNoPlaceIsNamed) {
  SurfaceSource source = box_surface();
  const PosedView& view = source.views[0];
  EXPECT_THAT(located(source, view, {2, 2}, {}).error().message(), HasSubstr("no surface there"));
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(-1, 5), Eigen::Vector2d(641, 5), Eigen::Vector2d(std::nan(""), 5)})
    EXPECT_THAT(located(source, view, pixel, {}).error().message(),
                HasSubstr("outside of the picture"));
  source.depth = [](const Camera&, const Rigid3d&, const Progress&) -> Result<cv::Mat> {
    return fail(ErrorKind::input, "field.bin", "damaged", "run again");
  };
  EXPECT_THAT(located(source, view, {320, 240}, {}).error().message(), HasSubstr("field.bin"));
  EXPECT_FALSE(located(source, Eigen::Vector3d::Zero(), 2, {}));
}

TEST(Located, ADistanceIsAsUnsureAsItsEnds) {
  const Located a{{0, 0, 0}, {1, 0, 0}, 0.01, 0.1}, b{{0, 2, 0}, {1, 0, 0}, 0.02, 0.1};
  EXPECT_DOUBLE_EQ(apart(a, b).length, 2);
  EXPECT_NEAR(apart(a, b).sigma, std::hypot(0.01, 0.02), 1e-3);  // across both rays
  const Located behind{{3, 0, 0}, {1, 0, 0}, 0.02, 0.1};
  EXPECT_NEAR(apart(a, behind).sigma, std::hypot(0.1, 0.1), 1e-5);
  // Beside a short line the ray's error counts in full, and no jump lies between.
  const Located near{{0, 1e-6, 0}, {1, 0, 0}, 0.01, 0.1};
  EXPECT_EQ(apart(a, a).length, 0);
  EXPECT_NEAR(apart(a, a).sigma, std::hypot(0.1, 0.1), 0.002);
  EXPECT_NEAR(apart(a, near).sigma, apart(a, a).sigma, 1e-4);
}

}  // namespace
}  // namespace orbitfuse::measurement
