// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/pca_msif/pca_msif.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "fusion/pca_msif/fast_explicit_diffusion.hpp"

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

/// The pattern that the stencil's symbol is largest for, in both axes.
Plane fastest_pattern(Stencil stencil) {
  Plane worst(64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      worst(y, x) = (stencil == Stencil::wide ? x / 2 + y / 2 : x + y) % 2 ? 1.0F : -1.0F;
  return worst;
}

class Smoother : public ::testing::TestWithParam<Stencil> {};

TEST_P(Smoother, StableAtItsLimitAndKeepsTheMean) {
  SmootherOptions o{.iterations = 200,
                    .time_step = largest_stable_step(GetParam()),
                    .cycles = 0,
                    .edge_scale = 1e5,
                    .stencil = GetParam()};
  ASSERT_TRUE(o.validate());
  const Plane image = noise(40, 56, 1);
  const Plane result = smooth(image, o);
  EXPECT_TRUE(cv::checkRange(result));
  EXPECT_LT(energy(result), energy(image)) << "an unstable step grows";
  EXPECT_NEAR(cv::mean(result)[0], cv::mean(image)[0], 1e-2);
}

TEST_P(Smoother, BeyondItsLimitIsRefusedBecauseItDiverges) {
  SmootherOptions o{.iterations = 200,
                    .time_step = 2.1 * largest_stable_step(GetParam()),
                    .cycles = 0,
                    .edge_scale = 1e5,
                    .stencil = GetParam()};
  const Status status = o.validate();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().where, "pca_msif.smoother.time_step");
  const Plane worst = fastest_pattern(GetParam());
  EXPECT_GT(energy(smooth(worst, o)), 100 * energy(worst)) << "the limit would be too careful";
}

/// The published step, pixel by pixel in double precision.
cv::Mat1d plain_step(const cv::Mat1d& image, const SmootherOptions& o) {
  const int r = o.stencil == Stencil::wide ? 2 : 1;
  const double scale = r == 2 ? 0.25 : 1;
  const auto at = [](const cv::Mat1d& m, int y, int x) {
    const auto inside = [](int i, int n) { return i < 0 ? -1 - i : i >= n ? 2 * n - 1 - i : i; };
    return m(inside(y, m.rows), inside(x, m.cols));
  };
  const auto dxx = [&](const cv::Mat1d& m, int y, int x) {
    return scale * (at(m, y, x - r) - 2 * m(y, x) + at(m, y, x + r));
  };
  const auto dyy = [&](const cv::Mat1d& m, int y, int x) {
    return scale * (at(m, y - r, x) - 2 * m(y, x) + at(m, y + r, x));
  };
  cv::Mat1d xx(image.size()), yy(image.size()), next(image.size());
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const double a = dxx(image, y, x), b = dyy(image, y, x);
      const double c = 1 / (1 + (a * a + b * b) / (o.edge_scale * o.edge_scale));
      xx(y, x) = c * a;
      yy(y, x) = c * b;
    }
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      next(y, x) = image(y, x) - o.time_step * (dxx(xx, y, x) + dyy(yy, y, x));
  return next;
}

TEST_P(Smoother, PlainStepsAreThePublishedOnes) {
  const SmootherOptions o{.iterations = 25,
                          .time_step = 0.9 * largest_stable_step(GetParam()),
                          .cycles = 0,
                          .edge_scale = 4,
                          .stencil = GetParam()};
  const Plane image = noise(23, 37, 8);
  cv::Mat1d expected;
  image.convertTo(expected, CV_64F);
  for (int i = 0; i < o.iterations; ++i) expected = plain_step(expected, o);
  cv::Mat1d result;
  smooth(image, o).convertTo(result, CV_64F);
  EXPECT_LT(cv::norm(result, expected, cv::NORM_INF), 0.02);
  EXPECT_GT(cv::norm(smooth(image, o), image, cv::NORM_INF), 1) << "the test would say nothing";
}

TEST_P(Smoother, CyclesAreStableForAnyTime) {
  for (const int iterations : {1, 2, 7, 40, 1000, 10000})
    for (const int cycles : {1, 2, 9}) {
      const SmootherOptions o{.iterations = iterations,
                              .time_step = largest_stable_step(GetParam()),
                              .cycles = cycles,
                              .edge_scale = 1e5,
                              .stencil = GetParam()};
      for (const Plane& image : {fastest_pattern(GetParam()), noise(40, 56, 1)}) {
        const Plane result = smooth(image, o);
        ASSERT_TRUE(cv::checkRange(result));
        EXPECT_LE(energy(result), 1.001 * energy(image)) << iterations << " in " << cycles;
        EXPECT_NEAR(cv::mean(result)[0], cv::mean(image)[0], 1e-2);
      }
    }
}

TEST_P(Smoother, CyclesReachWhatPlainStepsReach) {
  Plane image(64, 80);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 80; ++x)
      image(y, x) = 100 + 50 * std::sin(0.5F * static_cast<float>(x)) *
                              std::cos(0.4F * static_cast<float>(y));
  // So far-reaching an edge scale that conductivities stay at 1: the linear equation.
  SmootherOptions o{.iterations = 60,
                    .time_step = largest_stable_step(GetParam()),
                    .cycles = 0,
                    .edge_scale = 1e5,
                    .stencil = GetParam()};
  const Plane plain = smooth(image, o);
  o.cycles = 2;
  const double change = cv::norm(plain, image);
  EXPECT_GT(change, 100) << "the test would say nothing";
  EXPECT_LT(cv::norm(smooth(image, o), plain), 0.05 * change);
}

INSTANTIATE_TEST_SUITE_P(Stencils, Smoother, ::testing::Values(Stencil::wide, Stencil::compact));

TEST(SmootherOptionsTest, FieldsAreNamed) {
  SmootherOptions o;
  o.iterations = -1;
  EXPECT_EQ(o.validate().error().where, "pca_msif.smoother.iterations");
  o = {};
  o.cycles = -1;
  EXPECT_EQ(o.validate().error().where, "pca_msif.smoother.cycles");
  o = {};
  o.edge_scale = 0;
  EXPECT_EQ(o.validate().error().where, "pca_msif.smoother.edge_scale");
}

TEST(FastExplicitSteps, ReachTheirTimeInFewSteps) {
  for (const double limit : {1.0, 1.0 / 16})
    for (const double time : {0.1, 1.0, 18.0, 140.0}) {
      const auto steps = fast_explicit_steps(time * limit, limit);
      EXPECT_NEAR(std::accumulate(steps.begin(), steps.end(), 0.0), time * limit, 1e-9);
      EXPECT_LE(steps.size(), std::ceil(std::sqrt(3 * time)) + 1);
    }
  EXPECT_EQ(fast_explicit_steps(18, 1).size(), 7U);
  EXPECT_EQ(fast_explicit_steps(longest_cycle(1), 1).size(), 20U);
}

TEST(Smooth, NoIterationLeavesTheImage) {
  const Plane image = noise(16, 16, 5);
  EXPECT_EQ(cv::norm(smooth(image, {.iterations = 0}), image, cv::NORM_INF), 0);
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
