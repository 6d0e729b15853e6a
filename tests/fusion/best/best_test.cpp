// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/best.hpp"

#include <gtest/gtest.h>

#include "fusion/best/band_mix.hpp"
#include "fusion/best/base_rule.hpp"
#include "fusion/training/dead_leaves.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr BaseRule unbiased{0, 0};

Plane constant(float value) { return Plane(24, 31, value); }
Plane leaves(std::uint32_t seed) { return dead_leaves({31, 24}, seed); }

TEST(BestBaseRule, TheOnlySourceWithStructureIsTakenWhole) {
  const Plane structure = leaves(1), flat = constant(60);
  EXPECT_LT(cv::norm(fuse_base(structure, flat, unbiased), structure, cv::NORM_INF), 1e-3);
  EXPECT_LT(cv::norm(fuse_base(flat, structure, unbiased), structure, cv::NORM_INF), 1e-3);
}

TEST(BestBaseRule, FlatSourcesAreAveragedOrPreferred) {
  const Plane v = constant(200), t = constant(20);
  EXPECT_LT(cv::norm(fuse_base(v, t, {1, 0}), v, cv::NORM_INF), 1e-3);
  EXPECT_LT(cv::norm(fuse_base(t, v, {0, 0.1F}), v, cv::NORM_INF), 1e-3) << "the brighter one";
  EXPECT_EQ(cv::norm(fuse_base(constant(0), constant(0), unbiased), cv::NORM_INF), 0);
}

TEST(BestBaseRule, StaysBetweenTheSourcesAndExchangesWithThem) {
  const Plane v = leaves(2), t = leaves(3);
  const Plane fused = fuse_base(v, t, unbiased);
  EXPECT_LT(cv::norm(fused, fuse_base(t, v, unbiased), cv::NORM_INF), 1e-3);
  for (int y = 0; y < v.rows; ++y)
    for (int x = 0; x < v.cols; ++x) {
      EXPECT_GE(fused(y, x), std::min(v(y, x), t(y, x)) - 1e-3F);
      EXPECT_LE(fused(y, x), std::max(v(y, x), t(y, x)) + 1e-3F);
    }
}

TEST(BestBaseRule, SmallestBaseIsOnePatch) {
  const Plane v = leaves(2)(cv::Rect(0, 0, 8, 8)), t(8, 8, 5.0F);
  EXPECT_LT(cv::norm(fuse_base(v, t, unbiased), v, cv::NORM_INF), 1e-3);
}

TEST(BestBandMix, TheStrongerBandIsTakenAtItsOwnLevel) {
  const BandSource v{constant(10), constant(100), constant(80)},
      t{constant(-3), constant(9), constant(160)};
  const Plane fused = mix_band(v, t, constant(80), {6, 1});
  EXPECT_NEAR(fused(5, 5), 90, 1e-3);
}

TEST(BestBandMix, ContrastIsKeptWhenTheLevelChanges) {
  const BandSource v{constant(10), constant(100), constant(90)},
      t{constant(0), constant(0), constant(20)};
  EXPECT_NEAR(mix_band(v, t, constant(110), {6, 0})(5, 5), 120, 1e-3);
  EXPECT_NEAR(mix_band(v, t, constant(110), {6, 1})(5, 5), 122, 1e-3)
      << "(110 + 10) / (90 + 10) of 10";
  EXPECT_NEAR(mix_band(v, t, constant(110), {6, 0.5F})(5, 5), 121, 1e-3);
  EXPECT_NEAR(mix_band(v, t, constant(1e6F), {6, 1})(5, 5), 1e6F + 15, 1) << "never more than 3/2";
}

TEST(BestBandMix, NothingTinyAndHugeStayFinite) {
  for (const float scale : {0.0F, 1e-20F, 1.0F, 1e15F}) {
    const BandSource v{constant(scale), constant(scale * scale), constant(-300)},
        t{constant(-scale), constant(0), constant(1e6F)};
    EXPECT_TRUE(cv::checkRange(mix_band(v, t, constant(0), {32, 1}))) << scale;
  }
  const BandSource one{constant(5), constant(0), constant(50)},
      two{constant(9), constant(0), constant(50)};
  EXPECT_NEAR(mix_band(one, two, constant(50), {6, 0.35F})(3, 3), 57, 1e-3)
      << "without energy: the mean";
}

TEST(Best, BlackHotImagesNeedNoBrightness) {
  // A cold-white body on a flat ground: with brightness off its structure alone decides.
  Plane v(64, 64, 120.0F), t(64, 64, 230.0F);
  t(cv::Rect(24, 24, 16, 16)) = 20;
  BestOptions options;
  options.brightness_weight = 0;
  const auto fused = fuse_best(v, t, options);
  ASSERT_TRUE(fused);
  EXPECT_LT((*fused)(32, 32), 60);
}

}  // namespace
}  // namespace orbitfuse::fusion
