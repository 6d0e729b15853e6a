// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field/traced_ray.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse::nerf {
namespace {

/// Samples a unit long, the k-th from k to k + 1.
float distance_where(float surface_light) {
  const float t[] = {0.5f, 1.5f, 2.5f, 3.5f}, dt[] = {1, 1, 1, 1}, left[] = {1, 0.8f, 0.4f, 0.2f};
  TracedRay ray{};
  ray.distance = std::numeric_limits<float>::quiet_NaN();
  read_light(4, t, dt, left, 1e-3f, surface_light, ray);
  return ray.distance;
}

TEST(TracedRay, TheSurfaceLiesWhereSoMuchLightIsLeft) {
  EXPECT_NEAR(distance_where(0.9f), 1.5, 1e-6);
  EXPECT_NEAR(distance_where(0.7f), 2.25, 1e-6);
  EXPECT_NEAR(distance_where(0.5f), 2.75, 1e-6);
  EXPECT_NEAR(distance_where(0.3f), 3.5, 1e-6);
  EXPECT_TRUE(std::isnan(distance_where(0.1f))) << "more is left all the way";
}

}  // namespace
}  // namespace orbitfuse::nerf
