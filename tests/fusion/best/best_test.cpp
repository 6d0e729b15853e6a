// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/best.hpp"

#include <gtest/gtest.h>

#include "fusion/best/band_mix.hpp"
#include "fusion/best/base_rule.hpp"
#include "fusion/training/dead_leaves.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr BaseRule unbiased{0, 0, 0, 0, 0};

Plane constant(float value) { return Plane(24, 31, value); }
const Plane none = constant(0), half = constant(0.5F);
Plane leaves(std::uint32_t seed) { return dead_leaves({31, 24}, seed); }

TEST(BestBaseRule, TheOnlySourceWithStructureIsTakenWhole) {
  const Plane structure = leaves(1), flat = constant(60);
  EXPECT_LT(cv::norm(fuse_base(structure, flat, unbiased).level, structure, cv::NORM_INF), 1e-3);
  EXPECT_LT(cv::norm(fuse_base(flat, structure, unbiased).level, structure, cv::NORM_INF), 1e-3);
}

TEST(BestBaseRule, FlatSourcesAreAveragedOrPreferred) {
  const Plane v = constant(200), t = constant(20);
  EXPECT_LT(cv::norm(fuse_base(v, t, {1, 0, 0, 0, 0}).level, v, cv::NORM_INF), 1e-3);
  EXPECT_LT(cv::norm(fuse_base(t, v, {0, 0.1F, 0, 0, 0}).level, v, cv::NORM_INF), 1e-3)
      << "the brighter one";
  EXPECT_EQ(cv::norm(fuse_base(constant(0), constant(0), unbiased).level, cv::NORM_INF), 0);
}

TEST(BestBaseRule, StaysBetweenTheSourcesAndExchangesWithThem) {
  const Plane v = leaves(2), t = leaves(3);
  const Plane fused = fuse_base(v, t, unbiased).level;
  EXPECT_LT(cv::norm(fused, fuse_base(t, v, unbiased).level, cv::NORM_INF), 1e-3);
  for (int y = 0; y < v.rows; ++y)
    for (int x = 0; x < v.cols; ++x) {
      EXPECT_GE(fused(y, x), std::min(v(y, x), t(y, x)) - 1e-3F);
      EXPECT_LE(fused(y, x), std::max(v(y, x), t(y, x)) + 1e-3F);
    }
}

TEST(BestBaseRule, SmallestBaseIsOnePatch) {
  const Plane v = leaves(2)(cv::Rect(0, 0, 8, 8)), t(8, 8, 5.0F);
  EXPECT_LT(cv::norm(fuse_base(v, t, unbiased).level, v, cv::NORM_INF), 1e-3);
}

/// A plain wall beside a body: patches across its edge vote for the body's source, the wall doesn't
/// follow them.
TEST(BestBaseRule, APlainRegionIsOneSources) {
  Plane v(40, 60, 150.0F), t(40, 60, 30.0F);
  t(cv::Rect(0, 0, 20, 40)) = 200;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 20; ++x) t(y, x) += static_cast<float>((x * 7 + y * 13) % 23);
  const FusedBase shared = fuse_base(v, t, {2, 0, 0, 0, 0}),
                  decided = fuse_base(v, t, {2, 0, 400, 8, 0});
  int between_shared = 0, between_decided = 0;
  for (int x = 22; x < 60; ++x) {
    between_shared += shared.weight(20, x) > 0.1F && shared.weight(20, x) < 0.9F;
    between_decided += decided.weight(20, x) > 0.1F && decided.weight(20, x) < 0.9F;
  }
  EXPECT_GT(between_shared, 2);
  EXPECT_EQ(between_decided, 0);
  EXPECT_GT(decided.weight(20, 50), 0.9F);
  EXPECT_LT(decided.weight(20, 8), 0.1F);
}

TEST(BestBaseRule, WeightsOfExtremeLevelsStayFinite) {
  for (const float level : {0.0F, 1e-20F, 255.0F, 1e15F}) {
    const Plane v = leaves(2), t = leaves(3) * level;
    const FusedBase fused = fuse_base(v, t, {2, 0.02F, 400, 8, 0.15F});
    EXPECT_TRUE(cv::checkRange(fused.weight, true, nullptr, 0, 1 + 1e-6)) << level;
    EXPECT_TRUE(cv::checkRange(fused.level)) << level;
  }
}

TEST(BestBandMix, ABaseDecidesBetweenBandsOfOneStrength) {
  const BandSource v{constant(10), constant(100), constant(80)},
      t{constant(-10), constant(100), constant(80)};
  for (const float base : {0.0F, 1.0F})
    EXPECT_NEAR(mix_band(v, t, none, constant(80), constant(base), {6, 0, 8, 0})(5, 5),
                base > 0 ? 90 : 70, 0.02);
}

TEST(BestBandMix, OppositeBandsAreNotMixed) {
  const BandSource v{constant(10), constant(100), constant(80)},
      t{constant(-11), constant(121), constant(80)};
  const BandMix rule{6, 0, 0, 8};
  for (const float share : {0.0F, 1.0F})
    EXPECT_NEAR(mix_band(v, t, constant(-110), constant(80), constant(share), rule)(5, 5),
                share > 0 ? 90 : 69, 0.05);
  EXPECT_LT(mix_band(v, t, constant(110), constant(80), constant(1), rule)(5, 5), 75)
      << "of one direction the stronger one is taken";
}

TEST(BestBandMix, TheStrongerBandIsTakenAtItsOwnLevel) {
  const BandSource v{constant(10), constant(100), constant(80)},
      t{constant(-3), constant(9), constant(160)};
  const Plane fused = mix_band(v, t, none, constant(80), half, {6, 1, 0, 0});
  EXPECT_NEAR(fused(5, 5), 90, 1e-3);
}

TEST(BestBandMix, ContrastIsKeptWhenTheLevelChanges) {
  const BandSource v{constant(10), constant(100), constant(90)},
      t{constant(0), constant(0), constant(20)};
  EXPECT_NEAR(mix_band(v, t, none, constant(110), half, {6, 0, 0, 0})(5, 5), 120, 1e-3);
  EXPECT_NEAR(mix_band(v, t, none, constant(110), half, {6, 1, 0, 0})(5, 5), 122, 1e-3)
      << "(110 + 10) / (90 + 10) of 10";
  EXPECT_NEAR(mix_band(v, t, none, constant(110), half, {6, 0.5F, 0, 0})(5, 5), 121, 1e-3);
  EXPECT_NEAR(mix_band(v, t, none, constant(1e6F), half, {6, 1, 0, 0})(5, 5), 1e6F + 15, 1)
      << "never more than 3/2";
}

TEST(BestBandMix, NothingTinyAndHugeStayFinite) {
  for (const float scale : {0.0F, 1e-20F, 1.0F, 1e15F}) {
    const BandSource v{constant(scale), constant(scale * scale), constant(-300)},
        t{constant(-scale), constant(0), constant(1e6F)};
    EXPECT_TRUE(cv::checkRange(mix_band(v, t, none, constant(0), half, {32, 1, 0, 0}))) << scale;
  }
  const BandSource one{constant(5), constant(0), constant(50)},
      two{constant(9), constant(0), constant(50)};
  EXPECT_NEAR(mix_band(one, two, none, constant(50), half, {6, 0.35F, 0, 0})(3, 3), 57, 1e-3)
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
