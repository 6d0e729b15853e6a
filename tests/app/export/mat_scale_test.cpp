// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/mat_scale.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace orbitfuse::exporting {
namespace {

/// A mat of 2 m in a world whose unit is 4 m, seen by `views` cameras round it with that noise.
std::vector<TagRay> orbit(const MatDesign& design, int views, double noise_rad, double turn_deg) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, noise_rad);
  const Similarity3d world_from_mat{
      0.25,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
      {5, -2, 1}};
  std::vector<TagRay> rays;
  for (int i = 0; i < views; ++i) {
    const double azimuth = turn_deg * M_PI / 180 * i;
    const Eigen::Vector3d eye =
        world_from_mat * Eigen::Vector3d(4 * std::cos(azimuth), 4 * std::sin(azimuth), 1.5);
    for (int tag = 0; tag < design.tags(); ++tag) {
      const auto corners = design.corners_m(tag);
      const Eigen::Vector3d middle = (corners[0] + corners[2]) / 2;
      Eigen::Vector3d direction = (world_from_mat * middle - eye).normalized();
      direction += Eigen::Vector3d(noise(random), noise(random), noise(random));
      rays.push_back({middle.head<2>(), eye, direction.normalized()});
    }
  }
  return rays;
}

MatDesign two_metres() {
  MatDesign design;
  design.size_m = 2;
  return design;
}

TEST(MatScale, TagsWhereRaysMeetGiveItWithItsUncertainty) {
  const MatDesign design = two_metres();
  const auto exact = scale_of_tags(orbit(design, 6, 0, 60), design);
  ASSERT_TRUE(exact) << exact.error().message();
  EXPECT_NEAR(exact->metres_per_unit, 4, 1e-9);
  EXPECT_EQ(exact->source, "mat");
  const auto noisy = scale_of_tags(orbit(design, 6, 1e-3, 60), design);
  ASSERT_TRUE(noisy);
  EXPECT_LT(std::abs(noisy->metres_per_unit / 4 - 1), 3 * noisy->relative_uncertainty);
  EXPECT_LT(noisy->relative_uncertainty, 0.005);
}

TEST(MatScale, AWrongTagDoesNotDecide) {
  const MatDesign design = two_metres();
  auto rays = orbit(design, 6, 1e-4, 60);
  for (TagRay& ray : rays)
    if (ray.on_mat_m.norm() < 0.1) ray.direction = -ray.direction.cross(Eigen::Vector3d::UnitX());
  const auto scale = scale_of_tags(rays, design);
  ASSERT_TRUE(scale) << scale.error().message();
  EXPECT_NEAR(scale->metres_per_unit, 4, 0.01);
}

TEST(MatScale, TooFewSidesOrTagsAreSaid) {
  const MatDesign design = two_metres();
  for (const auto& rays :
       {std::vector<TagRay>{}, orbit(design, 1, 0, 60), orbit(design, 5, 0, 0.5)}) {
    const auto scale = scale_of_tags(rays, design);
    ASSERT_FALSE(scale);
    EXPECT_EQ(scale.error().kind, ErrorKind::input);
    EXPECT_THAT(scale.error().message(), ::testing::HasSubstr("--distance"));
  }
  auto shuffled = orbit(design, 6, 0, 60);
  std::mt19937 random(3);
  std::vector<Eigen::Vector2d> places;
  for (int tag = 0; tag < design.tags(); ++tag)
    places.push_back(shuffled[static_cast<std::size_t>(tag)].on_mat_m);
  std::shuffle(places.begin(), places.end(), random);
  for (std::size_t i = 0; i < shuffled.size(); ++i)
    shuffled[i].on_mat_m = places[i % places.size()];
  EXPECT_FALSE(scale_of_tags(shuffled, design)) << "not this mat";
}

}  // namespace
}  // namespace orbitfuse::exporting
