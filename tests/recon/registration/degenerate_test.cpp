// SPDX-License-Identifier: BSD-3-Clause
// What registration answers where geometry gives no answer: a typed error or an ambiguity flag,
// never silent nonsense. Each shape is sampled twice and moved by a known similarity.
#include <gtest/gtest.h>

#include <limits>

#include "recon/registration/register.hpp"
#include "tests/recon/registration/shapes.hpp"

namespace orbitfuse {
namespace {

using namespace orbitfuse::testing;
using Draw = std::function<Eigen::Vector3d(Random&)>;

Similarity3d some_move() {
  Random random(42);
  return any_similarity(random);
}

Result<RegistrationReport> registered(const PointCloud& source, const PointCloud& target) {
  auto report = register_clouds(source, target, {}, {});
  if (report) {
    EXPECT_TRUE(report->target_from_source.is_finite());
    EXPECT_GT(report->target_from_source.scale, 0);
    EXPECT_TRUE(std::isfinite(report->score) && std::isfinite(report->rmse));
    EXPECT_FALSE(report->brief().empty());
  }
  return report;
}

Result<RegistrationReport> twice(const Draw& draw, int count = 2500, double noise = 0) {
  const auto noisy = [&](Random& random) -> Eigen::Vector3d {
    Eigen::Vector3d p = draw(random);
    if (noise > 0) p += noise * gaussian3(random);
    return p;
  };
  return registered(drawn(count, 1, noisy), moved(drawn(count, 2, noisy), some_move()));
}

void expect_input_error(const Result<RegistrationReport>& report) {
  ASSERT_FALSE(report) << report->brief();
  EXPECT_EQ(report.error().kind, ErrorKind::input);
  EXPECT_FALSE(report.error().remedy.empty());
}

void expect_flag_or_error(const Result<RegistrationReport>& report) {
  if (!report) return;
  EXPECT_TRUE(report->ambiguous) << report->brief();
  EXPECT_FALSE(report->ambiguity.empty());
}

void expect_right(const Result<RegistrationReport>& report, const Similarity3d& truth) {
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_LT(rotation_angle_deg(report->target_from_source.rotation, truth.rotation), 1);
  EXPECT_NEAR(report->target_from_source.scale / truth.scale, 1, 0.01);
}

TEST(Degenerate, Plane) { expect_input_error(twice(on_plane)); }
TEST(Degenerate, NoisyPlane) { expect_flag_or_error(twice(on_plane, 2500, 0.005)); }
TEST(Degenerate, Line) { expect_input_error(twice(on_line)); }
TEST(Degenerate, NoisyLine) { expect_flag_or_error(twice(on_line, 2500, 0.01)); }
TEST(Degenerate, Sphere) { expect_flag_or_error(twice(on_sphere)); }
TEST(Degenerate, NoisySphere) { expect_flag_or_error(twice(on_sphere, 2500, 0.02)); }
TEST(Degenerate, Cylinder) { expect_flag_or_error(twice(on_cylinder)); }
TEST(Degenerate, NoisyCylinder) { expect_flag_or_error(twice(on_cylinder, 2500, 0.02)); }
TEST(Degenerate, Cube) { expect_flag_or_error(twice(on_cube)); }
TEST(Degenerate, NoisyCube) { expect_flag_or_error(twice(on_cube, 2500, 0.01)); }
TEST(Degenerate, UnrelatedShapes) {
  expect_flag_or_error(
      registered(drawn(2500, 1, on_potato), moved(drawn(2500, 2, on_cube), some_move())));
}
TEST(Degenerate, VolumeOfNoise) {
  expect_flag_or_error(registered(drawn(2500, 1, gaussian3), drawn(2500, 2, gaussian3)));
}

TEST(Degenerate, OneRepeatedPoint) {
  PointCloud cloud;
  cloud.positions.assign(500, {1, 2, 3});
  expect_input_error(registered(cloud, cloud));
  expect_input_error(registered(drawn(500, 1, on_potato), cloud));
  expect_input_error(registered(cloud, drawn(500, 1, on_potato)));
}

TEST(Degenerate, EmptyAndThreePoints) {
  expect_input_error(registered({}, {}));
  expect_input_error(registered(drawn(3, 1, on_potato), drawn(3, 2, on_potato)));
  expect_input_error(registered(drawn(500, 1, on_potato), drawn(3, 2, on_potato)));
}

TEST(Degenerate, ScarcePointsGiveAnAnswerOrAnError) {
  for (const int count : {20, 25, 40, 80}) {
    const auto report =
        registered(drawn(count, 1, on_potato), moved(drawn(count, 2, on_potato), some_move()));
    if (report &&
        rotation_angle_deg(report->target_from_source.rotation, some_move().rotation) > 10) {
      EXPECT_TRUE(report->ambiguous) << count << ": " << report->brief();
    }
  }
}

TEST(Degenerate, PointsThatAreNotFiniteAreDropped) {
  PointCloud source = drawn(2500, 1, on_potato);
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               inf = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < source.size(); i += 5)
    source.positions[i][static_cast<Eigen::Index>(i % 3)] = i % 2 ? nan : inf;
  expect_right(registered(source, moved(drawn(2500, 2, on_potato), some_move())), some_move());
  for (auto& p : source.positions) p.setConstant(nan);
  expect_input_error(registered(source, source));
}

TEST(Degenerate, HugeSizesAtHugeOffsets) {
  Similarity3d far;
  far.scale = 1e6;
  far.translation = {4e8, -4e8, 4e8};
  const PointCloud source = moved(drawn(2500, 1, on_potato), far);
  expect_right(registered(source, moved(moved(drawn(2500, 2, on_potato), far), some_move())),
               some_move());
}

TEST(Degenerate, TinySizes) {
  Similarity3d tiny;
  tiny.scale = 1e-6;
  const PointCloud source = moved(drawn(2500, 1, on_potato), tiny);
  expect_right(registered(source, moved(moved(drawn(2500, 2, on_potato), tiny), some_move())),
               some_move());
}

TEST(Degenerate, PointsRepeatedTwentyTimes) {
  const auto repeated = [](const PointCloud& cloud) {
    PointCloud many;
    for (int i = 0; i < 20; ++i)
      many.positions.insert(many.positions.end(), cloud.positions.begin(), cloud.positions.end());
    return many;
  };
  expect_right(registered(repeated(drawn(2000, 1, on_potato)),
                          moved(repeated(drawn(2000, 2, on_potato)), some_move())),
               some_move());
}

TEST(Degenerate, OneFarPointMovesNothing) {
  PointCloud source = drawn(2500, 1, on_potato);
  source.positions.push_back({1e9, 1e9, -1e9});
  expect_right(registered(source, moved(drawn(2500, 2, on_potato), some_move())), some_move());
}

}  // namespace
}  // namespace orbitfuse
