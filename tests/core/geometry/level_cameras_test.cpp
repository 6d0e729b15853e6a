// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/level_cameras.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/numeric/angle_units.hpp"

namespace orbitfuse {
namespace {

/// A level camera that looks at the origin from a distance of 3, then turned about its own axis.
Rigid3d camera_at(double azimuth_deg, double elevation_deg, double roll_deg = 0) {
  const double azimuth = azimuth_deg / degrees_per_radian;
  const double elevation = elevation_deg / degrees_per_radian;
  const Eigen::Vector3d out(std::cos(elevation) * std::cos(azimuth),
                            std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  Eigen::Matrix3d axes;
  axes.row(2) = -out;
  axes.row(0) = (-out).cross(Eigen::Vector3d::UnitZ()).normalized();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  const Eigen::Quaterniond roll(
      Eigen::AngleAxisd(roll_deg / degrees_per_radian, Eigen::Vector3d::UnitZ()));
  return {roll * Eigen::Quaterniond(axes), {0, 0, 3}};
}

std::vector<Rigid3d> orbit(double arc_deg, double elevation_deg, double roll_deg = 0) {
  std::vector<Rigid3d> cameras;
  for (int i = 0; i < 12; ++i)
    cameras.push_back(camera_at(arc_deg * i / 12, elevation_deg + i % 2, roll_deg));
  return cameras;
}

TEST(LevelCameras, UprightOnesThatClimbMoreThanTheyWalkAreNotOnTheirSide) {
  // Half a width of azimuth; elevations.
  const std::array<std::array<double, 3>, 4> climbs = {
      {{15, 5, 65}, {25, 0, 89}, {10, -20, 20}, {0, 5, 80}}};
  for (const auto& [reach_deg, low_deg, high_deg] : climbs) {
    std::vector<Rigid3d> cameras;
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j)
        cameras.push_back(
            camera_at(reach_deg * (i - 2) / 2.0, low_deg + (high_deg - low_deg) * j / 4));
    EXPECT_FALSE(held_on_side(cameras)) << reach_deg << " " << high_deg;
    EXPECT_GT(up_direction(cameras).z(), 0.5) << reach_deg << " " << high_deg;
  }
}

TEST(LevelCameras, UpOfAnyArcAndElevationIsTheCamerasOwn) {
  for (const double elevation_deg : {-30.0, 0.0, 20.0, 50.0, 75.0})
    for (const double arc_deg : {120.0, 240.0, 360.0}) {
      const std::vector<Rigid3d> cameras = orbit(arc_deg, elevation_deg);
      EXPECT_FALSE(held_on_side(cameras)) << elevation_deg << " " << arc_deg;
      EXPECT_GT(up_direction(cameras).z(), 0.99) << elevation_deg << " " << arc_deg;
    }
  EXPECT_FALSE(held_on_side(orbit(40, 20)));
  EXPECT_GT(up_direction(orbit(40, 20)).z(), 0.9);
}

TEST(LevelCameras, CamerasOnTheirSideStandAboveWhatTheyLookAt) {
  for (const double roll_deg : {90.0, -90.0, 80.0})
    for (const double elevation_deg : {5.0, 20.0, 40.0}) {
      const std::vector<Rigid3d> cameras = orbit(360, elevation_deg, roll_deg);
      EXPECT_TRUE(held_on_side(cameras)) << elevation_deg << " " << roll_deg;
      EXPECT_GT(up_direction(cameras).z(), 0.99) << elevation_deg << " " << roll_deg;
    }
}

TEST(LevelCameras, CamerasThatDisagreeAboutUpAreCounted) {
  const auto share = [](const std::vector<Rigid3d>& cameras) {
    return share_not_upright(cameras, up_direction(cameras));
  };
  for (const double elevation_deg : {0.0, 20.0, 50.0, 75.0, 88.0})
    for (const double roll_deg : {0.0, 15.0})
      EXPECT_EQ(share(orbit(360, elevation_deg, roll_deg)), 0) << elevation_deg << " " << roll_deg;
  std::vector<Rigid3d> half = orbit(360, 20);
  for (const Rigid3d& lying : orbit(360, 20, 90)) half.push_back(lying);
  EXPECT_GT(share(half), 0.2);
  EXPECT_GT(share(orbit(360, 50, 90)), 0.2);  // not seen to lie on their side
  EXPECT_EQ(share_not_upright({}, Eigen::Vector3d::UnitZ()), 0);
}

TEST(LevelCameras, NoneOrOneOrParallelOnesHaveAnAnswer) {
  EXPECT_FALSE(held_on_side({}));
  EXPECT_FALSE(look_at_point({}).allFinite());
  const std::vector<Rigid3d> alone = {Rigid3d{}};
  EXPECT_FALSE(held_on_side(alone));
  EXPECT_FALSE(look_at_point(alone).allFinite());
  EXPECT_NEAR(up_direction(alone).y(), -1, 1e-12);
  EXPECT_NEAR(up_direction({alone[0], alone[0]}).y(), -1, 1e-12);
}

}  // namespace
}  // namespace orbitfuse
