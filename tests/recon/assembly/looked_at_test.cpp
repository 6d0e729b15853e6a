// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/looked_at.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace orbitfuse {
namespace {

const Eigen::Vector3d aim(1, 2, 3);
constexpr double radius = 5;

PosedView looking_in(double azimuth_deg) {
  const double a = azimuth_deg * std::numbers::pi / 180;
  const Eigen::Vector3d eye = aim + radius * Eigen::Vector3d(std::cos(a), std::sin(a), 0.3);
  const Eigen::Vector3d z = (aim - eye).normalized(),
                        x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d r;
  r << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(r);
  return {"v", Camera::from_fov(80, 60, 58), {q, -(q * eye)}};
}

std::vector<PosedView> orbit() {
  std::vector<PosedView> views;
  for (int a = 0; a < 360; a += 30) views.push_back(looking_in(a));
  return views;
}

/// An object of 20 to 40 degrees in the middle, ground of 18 behind it, a sky of -30 at any depth.
ThermalView seen_from(const PosedView& view, float sky_depth) {
  ThermalView seen{view, cv::Mat1f(60, 80, 291.0F), cv::Mat1f(60, 80, 9.0F)};
  seen.thermal.rowRange(0, 25).setTo(243);
  seen.depth.rowRange(0, 25).setTo(sky_depth);
  const cv::Rect object(30, 20, 20, 20);
  for (int x = 0; x < object.width; ++x)
    seen.thermal(object).col(x).setTo(293 + 20 * x / (object.width - 1.0));
  seen.depth(object).setTo(5.1);
  return seen;
}

TEST(ObjectSpan, IsTheObjectsNotTheSkys) {
  for (const float sky :
       {30.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    const TemperatureSpan span =
        object_span({seen_from(orbit()[0], sky), seen_from(orbit()[4], sky)}, orbit());
    EXPECT_NEAR(span.low_k, 293, 1.5) << sky;
    EXPECT_NEAR(span.high_k, 313, 0.5) << sky;
  }
}

TEST(ObjectSpan, ASmallHotPartIsWithin) {
  ThermalView seen = seen_from(orbit()[0], 30);
  seen.thermal(cv::Rect(40, 30, 2, 1)).setTo(345);
  EXPECT_NEAR(object_span({seen}, orbit()).high_k, 345, 1e-2);
}

TEST(ObjectSpan, WithoutAnOrbitAllSamplesCount) {
  const PosedView one = looking_in(0);
  const std::vector<ThermalView> views{seen_from(one, 30)};
  EXPECT_NEAR(object_span(views, {one}).low_k, 243, 1e-3);
  // Nothing lies where the cameras look.
  ThermalView far = seen_from(one, 30);
  far.depth.setTo(500);
  EXPECT_NEAR(object_span({far}, orbit()).low_k, 243, 1e-3);
  EXPECT_GT(object_span({}, orbit()).high_k, object_span({}, orbit()).low_k) << "nothing at all";
}

TEST(ObjectSpan, ConstantAndUnmeasuredImagesHaveASpan) {
  ThermalView seen = seen_from(orbit()[0], 30);
  seen.thermal.setTo(290);
  const TemperatureSpan span = object_span({seen}, orbit());
  EXPECT_NEAR(span.high_k - span.low_k, 0.5, 1e-6);
  seen.thermal.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(std::isfinite(object_span({seen}, orbit()).low_k));
}

TEST(WithinOrbit, FartherReachHoldsMore) {
  const std::vector<ThermalView> views{seen_from(orbit()[0], 300)};
  const auto near = within_orbit(views, orbit(), object_reach)[0],
             around = within_orbit(views, orbit(), surroundings_reach)[0];
  EXPECT_EQ(cv::countNonZero(near == near), 400) << "the object";
  EXPECT_GT(cv::countNonZero(around == around), 2000) << "and the ground";
  EXPECT_EQ(cv::countNonZero(around < 250), 0) << "but no sky";
}

}  // namespace
}  // namespace orbitfuse
