// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/level_cameras.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/numeric/angle_units.hpp"

namespace orbitfuse {
namespace {

/// Level cameras that look at the origin from a distance of 3, each turned about its own axis.
std::vector<Rigid3d> orbit(double arc_deg, double elevation_deg, double roll_deg = 0) {
  const double radians = 1 / degrees_per_radian;
  std::vector<Rigid3d> cameras;
  for (int i = 0; i < 12; ++i) {
    const double azimuth = arc_deg * i / 12 * radians;
    const double elevation = (elevation_deg + i % 2) * radians;
    const Eigen::Vector3d out(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    Eigen::Matrix3d axes;
    axes.row(2) = -out;
    axes.row(0) = (-out).cross(Eigen::Vector3d::UnitZ()).normalized();
    axes.row(1) = axes.row(2).cross(axes.row(0));
    const Eigen::Quaterniond roll(Eigen::AngleAxisd(roll_deg * radians, Eigen::Vector3d::UnitZ()));
    cameras.push_back({roll * Eigen::Quaterniond(axes), {0, 0, 3}});
  }
  return cameras;
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
