// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/scene_ball.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace orbitfuse {
namespace {

/// A camera at `eye` that looks along `axis`.
Rigid3d camera_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& axis) {
  Rigid3d pose;
  pose.rotation = Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ());
  pose.translation = -(pose.rotation * eye);
  return pose;
}

TEST(SceneBall, IsWhereTheAxesMeetAndReachesTheCameras) {
  for (const double scale : {1e-3, 1.0, 1e4}) {
    const Eigen::Vector3d target = scale * Eigen::Vector3d(3, -2, 1);
    std::vector<Rigid3d> poses;
    for (int i = 0; i < 7; ++i) {
      const Eigen::Vector3d from(std::cos(i), std::sin(i), 0.3);
      poses.push_back(camera_at(target + 5 * scale * from.normalized(), -from));
    }
    const SceneBall ball = scene_ball(poses, {Eigen::Vector3d::Constant(99)});
    EXPECT_LT((ball.center - target).norm(), 1e-9 * scale);
    EXPECT_NEAR(ball.radius, 5 * scale, 1e-9 * scale);
  }
}

TEST(SceneBall, ParallelAxesTakeTheMedianPointOrLookAhead) {
  const std::vector<Rigid3d> poses = {camera_at({-1, 0, 0}, Eigen::Vector3d::UnitZ()),
                                      camera_at({1, 0, 0}, Eigen::Vector3d::UnitZ())};
  const SceneBall by_points = scene_ball(poses, {{0, 0, 4}, {0, 1, 5}, {900, 900, 900}});
  EXPECT_EQ(by_points.center, Eigen::Vector3d(0, 1, 5));
  EXPECT_LT((scene_ball(poses, {}).center - Eigen::Vector3d(0, 0, 2)).norm(), 1e-12);
}

TEST(SceneBall, OneViewAndEqualViewsHaveARadius) {
  for (const std::size_t count : {1u, 3u}) {
    const SceneBall ball = scene_ball(std::vector<Rigid3d>(count), {});
    EXPECT_LT((ball.center - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
    EXPECT_DOUBLE_EQ(ball.radius, 1);
  }
}

TEST(RmsRadius, IsOfTheMiddleWhereverThatIs) {
  EXPECT_EQ(rms_radius({}), 0);
  EXPECT_EQ(rms_radius({{5, 6, 7}}), 0);
  EXPECT_NEAR(rms_radius({{101, 0, 0}, {99, 0, 0}, {100, 2, 0}, {100, -2, 0}}), std::sqrt(2.5),
              1e-12);
}

}  // namespace
}  // namespace orbitfuse
