// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/lens_fold.hpp"

namespace orbitfuse {
namespace {

TEST(Camera, DistortionRoundTrip) {
  Camera c = Camera::from_fov(540, 960, 42);
  c.k1 = 0.06;
  c.k2 = -0.08;
  c.p1 = -0.001;
  c.p2 = 0.0002;
  for (double u : {0.5, 100.0, 269.9, 539.5}) {
    for (double v : {0.5, 480.0, 959.5}) {
      const Eigen::Vector2d back = c.pixel_of(c.normalized_of({u, v}));
      EXPECT_NEAR(back.x(), u, 1e-8);
      EXPECT_NEAR(back.y(), v, 1e-8);
    }
  }
}

TEST(Camera, PointBehindHasNoPixel) {
  const Camera c = Camera::from_fov(640, 480, 60);
  EXPECT_TRUE(c.project({0, 0, -1}).array().isNaN().all());
  EXPECT_TRUE(c.project({0, 0, 0}).array().isNaN().all());
}

TEST(Camera, ValidateNamesTheField) {
  Camera c = Camera::from_fov(640, 480, 60);
  c.k1 = std::numeric_limits<double>::infinity();
  const Status status = c.validate("cameras.txt:1");
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message().find("k1"), std::string::npos);
  c.k1 = 0;
  c.fx = -1;
  EXPECT_FALSE(c.validate("x"));
}

TEST(Camera, ImpossibleLensesAreRefusedAndCropsAreNot) {
  Camera c = Camera::from_fov(640, 480, 60);
  for (const double focal : {1e-3, 1.0, 1e6}) {
    c.fx = focal;
    const Status status = c.validate("x");
    ASSERT_FALSE(status) << focal;
    EXPECT_NE(status.error().message().find("640x480"), std::string::npos);
  }
  for (const double degrees : {1.0, 25.0, 150.0})
    EXPECT_TRUE(Camera::from_fov(640, 480, degrees).validate("x")) << degrees;
  c = Camera::from_fov(640, 480, 60);
  c.cx = 1e5;
  EXPECT_FALSE(c.validate("x"));
  // A small window from the corner of a large sensor.
  Camera corner = Camera::from_fov(4000, 3000, 60);
  corner.width = 64, corner.height = 64;
  EXPECT_TRUE(corner.validate("x"));
}

TEST(Camera, ScalingKeepsRays) {
  const Camera c = Camera::from_fov(800, 600, 58);
  const Camera half = c.scaled_to(400, 300);
  EXPECT_LT((c.ray_of({200, 100}) - half.ray_of({100, 50})).norm(), 1e-12);
}

TEST(LensFold, PointsThatTheModelBringsBackAreNotSeen) {
  Camera camera = Camera::from_fov(640, 480, 60);
  EXPECT_TRUE(lens_holds(camera, {50, 0, 1})) << "a straight lens never turns back";
  camera.k1 = -0.2;
  const double fold = std::sqrt(fold_of(camera));
  EXPECT_NEAR(fold, std::sqrt(1 / 0.6), 1e-12);
  const auto radius = [&](double r) { return camera.project({r, 0, 1}).x(); };
  EXPECT_GT(radius(fold), radius(fold - 0.01));
  EXPECT_GT(radius(fold), radius(fold + 0.01));
  const Eigen::Vector3d far_out(2.2, 0.1, 1);  // 66 degrees off the axis, in a view of 30
  const Eigen::Vector2d pixel = camera.project(far_out);
  ASSERT_TRUE(pixel.x() > 0 && pixel.x() < 640 && pixel.y() > 0 && pixel.y() < 480);
  EXPECT_FALSE(lens_holds(camera, far_out));
  EXPECT_TRUE(lens_holds(camera, {0.5, 0.3, 1}));
  camera.k2 = 0.01;  // turns back, and out again: the first turn counts
  EXPECT_NEAR(fold_of(camera), 2.0, 1e-12);
  camera.k2 = 1;
  EXPECT_TRUE(std::isinf(fold_of(camera)));
}

}  // namespace
}  // namespace orbitfuse
