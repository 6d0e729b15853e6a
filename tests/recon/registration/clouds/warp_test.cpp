// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/warp.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "recon/registration/clouds/thinning.hpp"
#include "recon/registration/clouds/warp_grid.hpp"
#include "recon/registration/register.hpp"
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

/// Root mean square distance between where the two put the surface.
double distance(const Similarity3d& a, const Similarity3d& b,
                const PointCloud& surface = drawn(300, 99, on_potato)) {
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

/// Why the report says that no warp was taken out; "" where it doesn't.
std::string skipped_warp(const RegistrationReport& report) {
  for (const Skip& s : report.skips) {
    if (s.what == "smooth warp beside the similarity") return s.why;
  }
  return "";
}

bool same(const Similarity3d& a, const Similarity3d& b) {
  return a.scale == b.scale && a.rotation.coeffs() == b.rotation.coeffs() &&
         a.translation == b.translation;
}

TEST(Warp, NoLongerPullsTheSimilarity) {
  double with = 0, without = 0;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const PointCloud target = noisy(drawn(2500, seed, on_potato), 0.02, 200 + seed);
    const PointCloud source =
        noisy(bent(drawn(2500, 100 + seed, on_potato), 0.025, seed), 0.02, 300 + seed);
    const RegistrationReport plain = refined(source, target, false);
    const RegistrationReport beside = refined(source, target, true);
    EXPECT_EQ(plain.warp, WarpOutcome::not_asked);
    EXPECT_EQ(plain.warp_percent_of_diameter, 0);
    EXPECT_EQ(beside.warp, WarpOutcome::found);
    EXPECT_EQ(skipped_warp(beside), "");
    EXPECT_FALSE(beside.ambiguous) << beside.ambiguity;
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
    EXPECT_EQ(beside.warp, WarpOutcome::none) << sigma;
    EXPECT_EQ(skipped_warp(beside), "the residuals show none") << sigma;
    EXPECT_EQ(beside.warp_percent_of_diameter, 0);
    EXPECT_EQ(distance(plain.target_from_source, beside.target_from_source), 0) << sigma;
  }
}

struct Stress {
  const char* name;
  Eigen::Vector3d (*draw)(Random&);
  int source_points, target_points;
  double warp;
  std::uint32_t seed;
  WarpOutcome outcome;
  double most;  ///< of the distance to the truth without the estimate of a warp
};

class WarpStress : public ::testing::TestWithParam<Stress> {};

/// Both clouds lie where they were drawn, so the truth is the identity; the source was bent since.
TEST_P(WarpStress, OutcomeAndErrorAreAsStated) {
  const Stress& c = GetParam();
  const PointCloud straight = drawn(c.source_points, c.seed, c.draw);
  const PointCloud source = bent(straight, c.warp, c.seed);
  const PointCloud target = drawn(c.target_points, 50 + c.seed, c.draw);
  const RegistrationReport plain = refined(source, target, false);
  const RegistrationReport beside = refined(source, target, true);
  EXPECT_EQ(beside.warp, c.outcome) << name_of(beside.warp);
  const double without = distance(plain.target_from_source, {}, straight);
  const double with = distance(beside.target_from_source, {}, straight);
  EXPECT_LE(with, c.most * without);
  const auto flagged_for = [&beside](const char* words) {
    return beside.ambiguous && beside.ambiguity.find(words) != std::string::npos;
  };
  const bool limit = c.outcome == WarpOutcome::at_limit;
  const bool diverged = c.outcome == WarpOutcome::diverged;
  EXPECT_EQ(flagged_for("may not show the same shape"), limit) << beside.ambiguity;
  EXPECT_EQ(flagged_for("without the bend could not be found"), diverged) << beside.ambiguity;
  if (limit) {
    EXPECT_NEAR(beside.warp_percent_of_diameter, 8.66, 0.01);
  }
  if (limit || c.outcome == WarpOutcome::found) {
    EXPECT_EQ(skipped_warp(beside), "");
    EXPECT_FALSE(same(beside.target_from_source, plain.target_from_source));
  } else {
    EXPECT_EQ(beside.warp_percent_of_diameter, 0);
    EXPECT_TRUE(same(beside.target_from_source, plain.target_from_source));
    EXPECT_NE(skipped_warp(beside).find(diverged                               ? "led away"
                                        : c.outcome == WarpOutcome::too_little ? "too few points"
                                                                               : "show none"),
              std::string::npos)
        << skipped_warp(beside);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Cases, WarpStress,
    ::testing::Values(
        Stress{"few_points", on_potato, 40, 40, 0.05, 1, WarpOutcome::too_little, 1},
        Stress{"few_against_many", on_potato, 60, 2500, 0.05, 1, WarpOutcome::none, 1},
        Stress{"sphere", on_sphere, 1500, 1500, 0.03, 1, WarpOutcome::found, 1.1},
        Stress{"cylinder", on_cylinder, 1500, 1500, 0.03, 1, WarpOutcome::found, 1.05},
        Stress{"cube", on_cube, 1500, 1500, 0.03, 1, WarpOutcome::found, 0.9},
        Stress{"strong_warp", on_potato, 1500, 1500, 0.05, 4, WarpOutcome::found, 0.8},
        Stress{"hardly_a_warp", on_potato, 1500, 1500, 0.15, 4, WarpOutcome::at_limit, 1},
        Stress{"bent_cylinder", on_cylinder, 1200, 1200, 0.2, 4, WarpOutcome::diverged, 1},
        Stress{"very_bent_cylinder", on_cylinder, 1200, 1200, 0.3, 2, WarpOutcome::diverged, 1}),
    [](const auto& c) { return c.param.name; });

TEST(Warp, SpreadIsOfTheAnswerGiven) {
  const PointCloud target = drawn(1200, 54, on_potato);
  const PointCloud source = bent(drawn(1200, 4, on_potato), 0.05, 4);
  const RegistrationReport plain = refined(source, target, false);
  const RegistrationReport beside = refined(source, target, true);
  const Similarity3d &a = plain.target_from_source, &b = beside.target_from_source;
  EXPECT_GT(rotation_angle_deg(a.rotation, b.rotation), 1);  // or the test shows nothing
  EXPECT_GE(beside.spread_rotation_deg, rotation_angle_deg(a.rotation, b.rotation) - 1e-9);
  EXPECT_GE(beside.spread_scale_percent, 100 * std::abs(std::log(a.scale / b.scale)) - 1e-9);
  EXPECT_LT(plain.spread_rotation_deg, 1);
  EXPECT_GT(beside.spread_rotation_deg, rotation_angle_deg(b.rotation, {1, 0, 0, 0}));  // the error
}

TEST(Warp, MeasuredAtTheEndOfARefinementIsWhatThatMeasured) {
  const auto source = prepare(noisy(drawn(1500, 1, on_potato), 0.01, 3), {}, "source");
  const auto target = prepare(noisy(drawn(1500, 2, on_potato), 0.01, 4), {}, "target");
  ASSERT_TRUE(source && target);
  const auto s = strided_subset(source->points.size(), 1 << 30);
  const auto t = strided_subset(target->points.size(), 1 << 30);
  const RefineOptions options{0.1, 0.06, 5, 30};
  const Similarity3d near = target->unit_from_cloud * source->unit_from_cloud.inverse();
  const Refined end = refine(*source, *target, s, t, near, options);
  const Refined measured = measured_at(*source, *target, s, t, end.target_from_source, options);
  EXPECT_TRUE(same(measured.target_from_source, end.target_from_source));
  EXPECT_NEAR(measured.residual_sigma, end.residual_sigma, 0.01 * end.residual_sigma);
  EXPECT_LT((measured.hessian - end.hessian).norm(), 0.01 * end.hessian.norm());
  Similarity3d off = end.target_from_source;
  off.translation.x() += 0.03;
  EXPECT_GT(measured_at(*source, *target, s, t, off, options).residual_sigma,
            1.2 * end.residual_sigma);
  off.translation.x() = 50;
  EXPECT_EQ(measured_at(*source, *target, s, t, off, options).pairs, 0);
}

TEST(Warp, AStartWithoutPartnersComesBack) {
  const auto cloud = prepare(drawn(500, 1, on_potato), {}, "cloud");
  ASSERT_TRUE(cloud);
  Refined start;
  start.target_from_source.translation = {50, 0, 0};
  const Unwarped found = refine_beside_warp(*cloud, *cloud, start, {});
  EXPECT_EQ(found.outcome, WarpOutcome::too_little);
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
    EXPECT_TRUE(grid.place(p));
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
