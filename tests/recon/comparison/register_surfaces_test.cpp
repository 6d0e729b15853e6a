// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/register_surfaces.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "tests/recon/comparison/yard.hpp"

namespace orbitfuse::comparison {
namespace {
using test::crate;
using test::house;
using test::shed;
using testing::HasSubstr;

Similarity3d some_similarity() {
  return {1.3,
          Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d(0.1, 0.2, 1).normalized())),
          {0.4, -0.7, 0.2}};
}

/// Largest distance between what two placements make of the yard's corners.
double apart(const Similarity3d& a, const Similarity3d& b) {
  double most = 0;
  for (const double x : {-2.0, 2.0})
    for (const double y : {-2.0, 2.0})
      most = std::max(most, (a * Eigen::Vector3d(x, y, 0) - b * Eigen::Vector3d(x, y, 0)).norm());
  return most;
}

TEST(RegisterSurfaces, WhatMovedDoesNotPull) {
  const Similarity3d before_from_after = some_similarity();
  const TriangleMesh before =
      test::moved(test::yard({house, shed, crate}, 0.07), before_from_after);
  const test::Box elsewhere{-1, 0.6, crate.width, crate.depth, crate.height};
  const auto found = register_surfaces(test::yard({house, shed, elsewhere}), before, {}, {}, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_LT(apart(found->before_from_after, before_from_after), 0.01);
  EXPECT_LT(found->residual, 1e-3);
  EXPECT_GT(found->overlap, 0.75);  // the crate is where the other's isn't
}

TEST(RegisterSurfaces, AnotherObjectIsRefused) {
  TriangleMesh ball;  // beside nothing flat that both have
  for (int i = 0; i < 40; ++i)
    test::add_face(ball,
                   Eigen::AngleAxisd(0.16 * i, Eigen::Vector3d(1, 2, 0.5).normalized()) *
                       Eigen::Vector3d(1.5, -0.1, -0.3),
                   {0.2, 0.3, 0.1}, {0.1, -0.1, 0.5}, 0.08);
  const auto found = register_surfaces(ball, test::yard({house, shed, crate}), {}, {}, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().where, "the registration");
  EXPECT_THAT(found.error().message(), HasSubstr("one object"));
}

TEST(RegisterSurfaces, GroundThatTwoObjectsShareMakesThemNotOne) {
  const TriangleMesh one = test::yard({house, shed, crate});
  const test::Box wider{house.x, house.y, 1.4 * house.width, 0.7 * house.depth, 1.3 * house.height},
      elsewhere{-1, 0.6, shed.width, shed.depth, 0.6 * shed.height};
  const auto found = refine_surfaces(test::yard({wider, elsewhere}), one, {}, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_LT(found->overlap, ComparisonOptions{}.least_overlap);
}

/// The yard with each of its faces' depth off: by what it shares with its neighbourhood, as a
/// field's depth is, and by what it does not.
TriangleMesh measured(const TriangleMesh& surface, double shared, double own,
                      std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  std::map<std::array<long, 4>, double> of_block;
  TriangleMesh mesh = surface;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Eigen::Vector3d& p = mesh.vertices.positions[i];
    const Eigen::Vector3d n = mesh.vertices.normals[i].cast<double>();
    const long way = std::lround(n.x() + 3 * n.y() + 9 * n.z());
    const auto [block, is_new] = of_block.try_emplace(
        {way, std::lround(p.x() / 0.5), std::lround(p.y() / 0.5), std::lround(p.z() / 0.5)}, 0.0);
    if (is_new) block->second = shared * normal(random);
    p += (block->second + own * normal(random)) * n;
  }
  return mesh;
}

TEST(RegisterSurfaces, TheScalesSigmaHoldsForNoiseThatNeighboursShareOrNot) {
  const TriangleMesh surface = test::yard({house, shed, crate}, 0.06);
  double stated_alone = 0;
  for (const double shared : {0.0, 0.006}) {
    std::mt19937 random(3);
    double squares = 0, stated = 0;
    constexpr int draws = 40;
    for (int i = 0; i < draws; ++i) {
      const auto found = refine_surfaces(measured(surface, shared, 0.006, random),
                                         measured(surface, shared, 0.006, random), {}, {});
      ASSERT_TRUE(found) << found.error().message();
      squares += std::pow(std::log(found->before_from_after.scale), 2) / draws;
      stated += found->scale_sigma / draws;
    }
    RecordProperty("off", std::to_string(std::sqrt(squares)));
    // 40 draws tell a standard deviation to 11 %.
    EXPECT_GT(stated, 0.6 * std::sqrt(squares)) << shared;
    EXPECT_LT(stated, 1.7 * std::sqrt(squares)) << shared;
    if (shared == 0)
      stated_alone = stated;
    else
      EXPECT_GT(stated, 2 * stated_alone);
  }
}

TEST(RegisterSurfaces, FlatGroundAloneCanSlide) {
  const auto found = refine_surfaces(test::yard({}), test::yard({}), {}, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::input);
  EXPECT_THAT(found.error().message(), HasSubstr("slide"));
}

TEST(RegisterSurfaces, EmptyAndBrokenSurfacesAreNamed) {
  const TriangleMesh whole = test::yard({house, shed, crate});
  EXPECT_EQ(refine_surfaces({}, whole, {}, {}).error().kind, ErrorKind::input);
  EXPECT_EQ(refine_surfaces(whole, {}, {}, {}).error().kind, ErrorKind::input);
  TriangleMesh broken = whole;
  for (std::size_t i = 0; i < broken.vertices.size(); ++i)
    broken.vertices.positions[i].setConstant(i % 2 != 0 ? std::numeric_limits<double>::quiet_NaN()
                                                        : std::numeric_limits<double>::infinity());
  EXPECT_EQ(refine_surfaces(broken, whole, {}, {}).error().kind, ErrorKind::input);
  // Some broken vertices are left out.
  TriangleMesh scratched = whole;
  for (std::size_t i = 0; i < scratched.vertices.size(); i += 50)
    scratched.vertices.positions[i].setConstant(std::numeric_limits<double>::quiet_NaN());
  const auto found = refine_surfaces(scratched, whole, {}, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_LT(apart(found->before_from_after, {}), 1e-6);
}

TEST(RegisterSurfaces, OptionsAreChecked) {
  ComparisonOptions options;
  options.least_overlap = std::numeric_limits<double>::quiet_NaN();
  const auto found = register_surfaces({}, {}, {}, options, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::usage);
  EXPECT_THAT(found.error().message(), HasSubstr("least_overlap"));
}

}  // namespace
}  // namespace orbitfuse::comparison
