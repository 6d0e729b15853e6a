// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/warp.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "recon/registration/register.hpp"
#include "recon/registration/thinning.hpp"
#include "recon/registration/warp_grid.hpp"
#include "tests/recon/registration/shapes.hpp"

namespace orbitfuse::registration {
namespace {

using namespace orbitfuse::testing;

/// Three plane waves that push each in its own direction; the potato's diameter is about 4.
PointCloud bent(PointCloud cloud, double amplitude, std::uint32_t seed) {
  Random random(seed);
  for (int wave = 0; wave < 3; ++wave) {
    const Eigen::Vector3d axis = on_sphere(random), push = on_sphere(random);
    const double phase = uniform(random, 0, 2 * std::numbers::pi);
    for (auto& p : cloud.positions)
      p += amplitude * std::sin(2 * std::numbers::pi / 3.2 * p.dot(axis) + phase) * push;
  }
  return cloud;
}

PointCloud noisy(PointCloud cloud, double sigma, std::uint32_t seed) {
  Random random(seed);
  for (auto& p : cloud.positions) p += sigma * gaussian3(random);
  return cloud;
}

/// Root mean square distance between where the two put the potato.
double distance(const Similarity3d& a, const Similarity3d& b) {
  const PointCloud surface = drawn(300, 99, on_potato);
  double sum = 0;
  for (const auto& p : surface.positions) sum += (a * p - b * p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(surface.size()));
}

RegistrationReport refined(const PointCloud& source, const PointCloud& target, bool estimate_warp) {
  RegistrationOptions options;
  options.estimate_warp = estimate_warp;
  const auto report = refine_registration(source, target, {}, options);
  EXPECT_TRUE(report) << report.error().message();
  return report ? *report : RegistrationReport{};
}

bool skipped_warp(const RegistrationReport& report) {
  return std::any_of(report.skips.begin(), report.skips.end(),
                     [](const Skip& s) { return s.what == "smooth warp beside the similarity"; });
}

TEST(Warp, NoLongerPullsTheSimilarity) {
  double with = 0, without = 0;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const PointCloud target = noisy(drawn(2500, seed, on_potato), 0.02, 200 + seed);
    const PointCloud source =
        noisy(bent(drawn(2500, 100 + seed, on_potato), 0.025, seed), 0.02, 300 + seed);
    const RegistrationReport plain = refined(source, target, false);
    const RegistrationReport beside = refined(source, target, true);
    EXPECT_EQ(plain.warp_percent_of_diameter, 0);
    EXPECT_FALSE(skipped_warp(beside));
    // True: 0.025 sqrt(3 / 2), about 0.8 % of the diameter; a part of it is a similarity.
    EXPECT_GT(beside.warp_percent_of_diameter, 0.25) << seed;
    EXPECT_LT(beside.warp_percent_of_diameter, 2) << seed;
    without += distance(plain.target_from_source, {});
    with += distance(beside.target_from_source, {});
  }
  EXPECT_LT(with, 0.75 * without);
}

TEST(Warp, IsSkippedWhereThereIsNone) {
  for (const double sigma : {0.0, 0.02, 0.04}) {
    const PointCloud source = noisy(drawn(2500, 1, on_potato), sigma, 3),
                     target = noisy(drawn(2500, 2, on_potato), sigma, 4);
    const RegistrationReport plain = refined(source, target, false);
    const RegistrationReport beside = refined(source, target, true);
    EXPECT_TRUE(skipped_warp(beside)) << sigma;
    EXPECT_EQ(beside.warp_percent_of_diameter, 0);
    EXPECT_EQ(distance(plain.target_from_source, beside.target_from_source), 0) << sigma;
  }
}

TEST(Warp, StressHasDefinedAnswers) {
  struct Case {
    const char* name;
    Eigen::Vector3d (*draw)(Random&);
    int source_points, target_points;
    double warp;
  };
  const Case cases[] = {
      {"few points", on_potato, 40, 40, 0.05}, {"few against many", on_potato, 60, 2500, 0.05},
      {"sphere", on_sphere, 1500, 1500, 0.03}, {"cylinder", on_cylinder, 1500, 1500, 0.03},
      {"cube", on_cube, 1500, 1500, 0.03},     {"another shape", on_potato, 1500, 1500, 0.5}};
  for (const Case& c : cases) {
    const auto source = prepare(bent(drawn(c.source_points, 1, c.draw), c.warp, 7), {}, "source");
    const auto target = prepare(drawn(c.target_points, 2, c.draw), {}, "target");
    ASSERT_TRUE(source && target) << c.name;
    const Similarity3d near = target->unit_from_cloud * source->unit_from_cloud.inverse();
    const Refined start =
        refine(*source, *target, strided_subset(source->points.size(), 1 << 30),
               strided_subset(target->points.size(), 1 << 30), near, {0.1, 0.06, 5, 20});
    const WarpOptions options;
    const Unwarped found = refine_beside_warp(*source, *target, start, options);
    const Similarity3d &a = found.target_from_source, &b = start.target_from_source;
    EXPECT_TRUE(a.is_finite()) << c.name;
    EXPECT_LE(found.amplitude, options.max_amplitude) << c.name;
    EXPECT_LT(rotation_angle_deg(a.rotation, b.rotation), 8.01) << c.name;
    EXPECT_LT(std::abs(std::log(a.scale / b.scale)), 0.1001) << c.name;
    if (!(found.amplitude > 0)) {
      EXPECT_EQ((a.translation - b.translation).norm(), 0) << c.name;
    }
  }
}

TEST(Warp, AStartWithoutPartnersComesBack) {
  const auto cloud = prepare(drawn(500, 1, on_potato), {}, "cloud");
  ASSERT_TRUE(cloud);
  Refined start;
  start.target_from_source.translation = {50, 0, 0};
  const Unwarped found = refine_beside_warp(*cloud, *cloud, start, {});
  EXPECT_EQ(found.amplitude, 0);
  EXPECT_EQ(found.target_from_source.translation.x(), 50);
}

TEST(WarpGrid, ReproducesALinearField) {
  const PointCloud cloud = drawn(2000, 1, on_potato);
  WarpGrid grid(cloud.positions, 0.4, 1, 1000);
  Eigen::Matrix3d linear;
  linear << 0.1, 0.2, -0.3, 0.4, -0.5, 0.6, 0.7, 0.8, 0.9;
  Eigen::VectorXd by_node(3 * static_cast<Eigen::Index>(grid.nodes().size()));
  for (std::size_t i = 0; i < grid.nodes().size(); ++i)
    by_node.segment<3>(3 * static_cast<Eigen::Index>(i)) = linear * grid.nodes()[i];
  grid.displace(by_node);
  for (const auto& p : cloud.positions) {
    EXPECT_GE(grid.place(p).cell, 0);
    EXPECT_LT((grid(p) - linear * p).norm(), 1e-12);
  }
  EXPECT_EQ(grid({100, 0, 0}).norm(), 0);
  EXPECT_EQ(grid({NAN, 0, 0}).norm(), 0);
}

TEST(WarpGrid, HasNoCornersWithoutPointsAndNoMoreThanAllowed) {
  EXPECT_TRUE(WarpGrid({}, 0.4, 1, 100).nodes().empty());
  EXPECT_TRUE(WarpGrid(Points(5, Eigen::Vector3d::Ones()), 0.4, 8, 100).nodes().empty());
  EXPECT_EQ(WarpGrid(Points(9, Eigen::Vector3d::Ones()), 0.4, 8, 100).nodes().size(), 8u);
  const PointCloud cloud = drawn(2000, 1, on_potato);
  const WarpGrid coarse(cloud.positions, 0.1, 1, 100);
  EXPECT_LE(coarse.nodes().size(), 100u);
  EXPECT_GT(coarse.nodes().size(), 8u);
}

}  // namespace
}  // namespace orbitfuse::registration
