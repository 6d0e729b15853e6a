// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/camera.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace orbitfuse
