// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/refine.hpp"

#include <gtest/gtest.h>

#include "recon/registration/clouds/score.hpp"
#include "recon/registration/clouds/thinning.hpp"
#include "tests/recon/registration/shapes.hpp"

namespace orbitfuse::registration {
namespace {

using namespace orbitfuse::testing;

TEST(PlaneJacobian, ForwardMatchesFiniteDifferences) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Similarity3d placement = any_similarity(random);
    const Eigen::Vector3d x = gaussian3(random), q = gaussian3(random), n = on_sphere(random),
                          c = gaussian3(random);
    const Vector7 j = plane_jacobian(placement * x - c, n);
    for (int k = 0; k < 7; ++k) {
      const double h = 1e-6;
      const auto residual = [&](double step) {
        return n.dot(updated(placement, c, step * Vector7::Unit(k)) * x - q);
      };
      EXPECT_NEAR((residual(h) - residual(-h)) / (2 * h), j[k], 1e-6);
    }
  }
}

TEST(PlaneJacobian, BackwardMatchesFiniteDifferencesAtContact) {
  // Exact where the target's point touches the source's plane point; first order nearby.
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Similarity3d placement = any_similarity(random);
    const Eigen::Vector3d x = gaussian3(random), m = on_sphere(random), c = gaussian3(random);
    const Eigen::Vector3d z = placement * x;
    const Vector7 j = plane_jacobian(z - c, placement.rotation * m);
    for (int k = 0; k < 7; ++k) {
      const double h = 1e-6;
      const auto residual = [&](double step) {
        const Similarity3d s = updated(placement, c, step * Vector7::Unit(k));
        return (s.rotation * m).dot(s * x - z);
      };
      EXPECT_NEAR((residual(h) - residual(-h)) / (2 * h), j[k], 1e-6);
    }
  }
}

TEST(Refine, ReturnsFromThreeDegreesAndThreePercent) {
  const auto source = prepare(drawn(2500, 1, on_potato), {}, "source");
  const auto target = prepare(drawn(2500, 2, on_potato), {}, "target");
  ASSERT_TRUE(source && target);
  const Similarity3d truth = target->unit_from_cloud * source->unit_from_cloud.inverse();
  Vector7 kick;
  kick << 0.03, -0.03, 0.03, 0.03, 0.03, -0.02, 0.02;
  const Similarity3d start = updated(truth, truth.translation, kick);
  const auto all_source = strided_subset(source->points.size(), 1 << 30);
  const auto all_target = strided_subset(target->points.size(), 1 << 30);
  const Refined found = refine(*source, *target, all_source, all_target, start, {});
  EXPECT_LT(rotation_angle_deg(found.target_from_source.rotation, truth.rotation), 0.15);
  EXPECT_NEAR(found.target_from_source.scale / truth.scale, 1, 1e-3);
}

TEST(Score, ShrinkingTheSourceNeverWins) {
  // One-way fitness is 1 when the source collapses onto one point of the target's surface.
  const auto source = prepare(drawn(2500, 1, on_potato), {}, "source");
  const auto target = prepare(drawn(2500, 2, on_potato), {}, "target");
  ASSERT_TRUE(source && target);
  const Similarity3d truth = target->unit_from_cloud * source->unit_from_cloud.inverse();
  const double right = agreement(*source, *target, truth, {}).score;
  EXPECT_GT(right, 0.8);
  for (const double shrink : {0.9, 0.7, 0.4, 0.1, 0.01}) {
    Similarity3d small = truth;
    small.scale *= shrink;
    small.translation = target->points[0];
    EXPECT_LT(agreement(*source, *target, small, {}).score, 0.5 * right) << shrink;
    small.translation = truth.translation;
    EXPECT_LT(agreement(*source, *target, small, {}).score, 0.9 * right) << shrink;
  }
}

}  // namespace
}  // namespace orbitfuse::registration
