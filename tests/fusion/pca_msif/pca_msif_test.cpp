// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pca_msif/pca_msif.hpp"

#include <gtest/gtest.h>

namespace orbitfuse::fusion {
namespace {

Plane noise(int rows, int cols, std::uint64_t seed) {
  Plane image(rows, cols);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0.0F, 255.0F);
  return image;
}

double energy(const Plane& p) {
  const Plane centred = p - cv::mean(p)[0];
  return cv::norm(centred, cv::NORM_L2SQR);
}

class Smoother : public ::testing::TestWithParam<Stencil> {};

TEST_P(Smoother, StableAtItsLimitAndKeepsTheMean) {
  SmootherOptions o{.iterations = 200, .time_step = largest_stable_step(GetParam()), .edge_scale = 1e5, .stencil = GetParam()};
  ASSERT_TRUE(o.validate());
  const Plane image = noise(40, 56, 1);
  const Plane result = smooth(image, o);
  EXPECT_TRUE(cv::checkRange(result));
  EXPECT_LT(energy(result), energy(image)) << "an unstable step grows";
  EXPECT_NEAR(cv::mean(result)[0], cv::mean(image)[0], 1e-2);
}

TEST_P(Smoother, BeyondItsLimitIsRefusedBecauseItDiverges) {
  SmootherOptions o{.iterations = 200, .time_step = 2.1 * largest_stable_step(GetParam()), .edge_scale = 1e5, .stencil = GetParam()};
  const Status status = o.validate();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().where, "pca_msif.smoother.time_step");
  // Worst case of the stencil: the pattern its symbol is largest for, in both axes.
  Plane worst(64, 64);
  const bool wide = GetParam() == Stencil::wide;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) worst(y, x) = wide ? ((x / 2 + y / 2) % 2 ? 1.0F : -1.0F) : ((x + y) % 2 ? 1.0F : -1.0F);
  EXPECT_GT(energy(smooth(worst, o)), 100 * energy(worst)) << "the limit would be too careful";
}

INSTANTIATE_TEST_SUITE_P(Stencils, Smoother, ::testing::Values(Stencil::wide, Stencil::compact));

TEST(SmootherOptionsTest, FieldsAreNamed) {
  SmootherOptions o;
  o.iterations = -1;
  EXPECT_EQ(o.validate().error().where, "pca_msif.smoother.iterations");
  o = {};
  o.edge_scale = 0;
  EXPECT_EQ(o.validate().error().where, "pca_msif.smoother.edge_scale");
}

TEST(Smooth, EdgesStayNoiseGoes) {
  Plane image = noise(64, 64, 2) * 0.02F;
  image.colRange(32, 64) += 200;
  const Plane result = smooth(image, {});
  const auto right = result.colRange(40, 60);
  cv::Scalar mean, before, after;
  cv::meanStdDev(image.colRange(40, 60), mean, before);
  cv::meanStdDev(right, mean, after);
  EXPECT_LT(after[0], before[0]);
  EXPECT_GT(cv::mean(result.col(34))[0] - cv::mean(result.col(29))[0], 190);
}

TEST(PcaWeights, RankZeroOneAndTwo) {
  const Plane flat(32, 32, 7.0F), a = noise(32, 32, 3);
  EXPECT_EQ(pca_weights(flat, flat), cv::Vec2d(0.5, 0.5));
  const auto one = pca_weights(a, flat);
  EXPECT_NEAR(one[0], 1, 1e-9);
  EXPECT_NEAR(one[1], 0, 1e-9);
  const auto proportional = pca_weights(a, 3 * a);  // rank 1
  EXPECT_NEAR(proportional[0], 0.25, 1e-6);
  const auto opposite = pca_weights(a, -1 * a);
  EXPECT_NEAR(opposite[0], 0.5, 1e-6);
  const auto any = pca_weights(a, noise(32, 32, 4));
  EXPECT_NEAR(any[0] + any[1], 1, 1e-12);
  EXPECT_GE(any[0], 0);
  EXPECT_GE(any[1], 0);
}

TEST(PcaMsif, IdenticalImagesAreSkipped) {
  const Plane a = noise(32, 32, 3);
  PcaMsifReport report;
  const auto fused = fuse_pca_msif(a, a, {}, &report);
  ASSERT_TRUE(fused);
  EXPECT_TRUE(report.skipped);
  EXPECT_EQ(cv::norm(*fused, a, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace orbitfuse::fusion
