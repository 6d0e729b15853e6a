// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/new_views.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace orbitfuse {
namespace {

constexpr double deg = std::numbers::pi / 180;
const Eigen::Vector3d target(1, 2, 3);

PosedView looking_in(double azimuth_deg, double elevation_deg, double radius) {
  const double a = azimuth_deg * deg, e = elevation_deg * deg;
  const Eigen::Vector3d eye =
      target +
      radius * Eigen::Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d r;
  r << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(r);
  return {"v", Camera::from_fov(800, 600, 58), {q, -(q * eye)}};
}

std::vector<PosedView> orbit(double from_deg, double to_deg) {
  std::vector<PosedView> views;
  for (double a = from_deg; a < to_deg; a += 30) views.push_back(looking_in(a, 20, 5));
  return views;
}

TEST(OrbitGeometry, FindsCentreAxisAndElevation) {
  const auto g = orbit_geometry(orbit(0, 360));
  ASSERT_TRUE(g);
  EXPECT_LT((g->center - target).norm(), 1e-9);
  EXPECT_NEAR(g->up.z(), 1, 1e-9);
  EXPECT_NEAR(g->radius, 5, 1e-9);
  EXPECT_NEAR(g->elevation_deg, 20, 1e-9);
  EXPECT_NEAR(g->azimuth_span_deg, 330, 1e-6);
}

TEST(NewViews, OrbitViewsLookAtTheCentreFromBetweenTheStations) {
  const auto posed = orbit(0, 360);
  const auto made = new_views(posed, {});
  ASSERT_TRUE(made);
  ASSERT_EQ(made->views.size(), 8U);
  EXPECT_THAT(made->described, testing::HasSubstr("orbit"));
  const Camera camera = made->views[0].camera;
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  for (const PosedView& v : made->views) {
    const Eigen::Vector2d pixel = camera.project(v.cam_from_world * target);
    EXPECT_NEAR(pixel.x(), 320, 1e-6);
    EXPECT_NEAR(pixel.y(), 240, 1e-6);
    // Upright: a point above the centre is higher in the image.
    EXPECT_LT(camera.project(v.cam_from_world * (target + Eigen::Vector3d(0, 0, 0.1))).y(), 240);
  }
  const Eigen::Vector3d out = camera_center(made->views[0].cam_from_world) - target;
  EXPECT_NEAR(std::atan2(out.y(), out.x()) / deg, 15, 1e-6);
}

TEST(NewViews, OfCamerasHeldOnTheirSideAreUpright) {
  std::vector<PosedView> posed = orbit(0, 360);
  const Rigid3d roll{Eigen::Quaterniond(Eigen::AngleAxisd(90 * deg, Eigen::Vector3d::UnitZ())),
                     Eigen::Vector3d::Zero()};
  for (PosedView& view : posed) {
    view.cam_from_world = roll * view.cam_from_world;
    view.camera = Camera::from_fov(600, 800, 45);
  }
  const auto geometry = orbit_geometry(posed);
  ASSERT_TRUE(geometry);
  EXPECT_NEAR(geometry->up.z(), 1, 1e-9);
  EXPECT_NEAR(geometry->elevation_deg, 20, 1e-9);
  const auto made = new_views(posed, {});
  ASSERT_TRUE(made);
  EXPECT_THAT(made->described, testing::HasSubstr("orbit"));
  const Camera camera = made->views[0].camera;
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  for (const PosedView& v : made->views) {
    EXPECT_LT((camera.project(v.cam_from_world * target) - Eigen::Vector2d(320, 240)).norm(), 1e-6);
    EXPECT_LT(camera.project(v.cam_from_world * (target + Eigen::Vector3d(0, 0, 0.1))).y(), 240);
  }
}

TEST(NewViews, TheElevationIsTheCamerasMedianUnlessOneIsGiven) {
  const auto elevation = [](const NewViewOptions& options) {
    const auto made = new_views(orbit(0, 360), options);
    const Eigen::Vector3d out = camera_center(made->views[0].cam_from_world) - target;
    return std::asin(out.normalized().z()) / deg;
  };
  EXPECT_NEAR(elevation({}), 20, 1e-6);
  NewViewOptions options;
  options.elevation_deg = -30;
  EXPECT_NEAR(elevation(options), -30, 1e-6);
  options.elevation_deg = 90;
  EXPECT_FALSE(options.validate());
}

TEST(NewViews, AnArcGetsItsOwnPathNotAnOrbit) {
  const auto made = new_views(orbit(0, 130), {});
  ASSERT_TRUE(made);
  EXPECT_THAT(made->described, testing::HasSubstr("only"));
  for (const PosedView& v : made->views) {
    const Eigen::Vector3d out = camera_center(v.cam_from_world) - target;
    EXPECT_GT(std::atan2(out.y(), out.x()) / deg, -1);
    EXPECT_LT(std::atan2(out.y(), out.x()) / deg, 121);
  }
}

TEST(NewViews, DegenerateCamerasGiveAnErrorOrAPath) {
  EXPECT_FALSE(new_views({}, {}));
  EXPECT_FALSE(new_views({looking_in(0, 0, 1)}, {}));
  std::vector<PosedView> parallel(3, looking_in(0, 0, 5));
  parallel[1].cam_from_world.translation.x() += 1;
  parallel[2].cam_from_world.translation.x() += 2;
  NewViewOptions options;
  EXPECT_TRUE(new_views(parallel, options)) << "a path needs no centre";
  options.path = PathKind::orbit;
  EXPECT_FALSE(new_views(parallel, options));
}

TEST(NewViews, OptionsNameTheirField) {
  NewViewOptions options;
  options.views = 0;
  EXPECT_THAT(options.validate().error().message(), testing::HasSubstr("render.views"));
  options = {};
  options.radius_scale = std::nan("");
  EXPECT_FALSE(options.validate());
}

}  // namespace
}  // namespace orbitfuse
