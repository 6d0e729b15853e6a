// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/band_rule.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "fusion/cnn_lpif/cnn_lpif.hpp"
#include "fusion/training/dead_leaves.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr BandRule rule{0.8F, 7};

Plane constant(float value) { return Plane(24, 31, value); }

TEST(BandRule, TheOnlySourceWithEnergyIsTakenWhole) {
  const Plane band = dead_leaves({31, 24}, 1) - 128;
  for (const float prior : {0.0F, 0.5F, 0.9F, 1.0F}) {
    const Plane t = fuse_band(constant(0), band, constant(0.5F), constant(prior), rule);
    EXPECT_LT(cv::norm(t, band, cv::NORM_INF), 1e-3) << "prior " << prior;
  }
}

TEST(BandRule, ScaleDoesNotMatter) {
  const Plane v = dead_leaves({31, 24}, 2) - 128, t = dead_leaves({31, 24}, 3) - 128;
  const Plane plain = fuse_band(v, t, constant(0.3F), constant(0.6F), rule);
  for (const float scale : {1e-15F, 1e-3F, 1e6F, 1e15F}) {
    const Plane scaled = fuse_band(v * scale, t * scale, constant(0.3F), constant(0.6F), rule);
    EXPECT_LT(cv::norm(scaled / scale, plain, cv::NORM_INF), 1e-2) << scale;
  }
}

TEST(BandRule, MatchingBandsAreWeightedByTheNetwork) {
  const Plane v = dead_leaves({31, 24}, 4) - 128, t = v * 1.01F;
  const Plane fused = fuse_band(v, t, constant(0.25F), constant(0.9F), rule);
  EXPECT_LT(cv::norm(fused, v * 1.0025F, cv::NORM_INF), 1e-3);
}

TEST(BandRule, ExchangeOfSourcesExchangesNothingElse) {
  const Plane v = dead_leaves({31, 24}, 5) - 128, t = dead_leaves({31, 24}, 6) - 128;
  const Plane one = fuse_band(v, t, constant(0.3F), constant(0.8F), rule),
              other = fuse_band(t, v, constant(0.7F), constant(0.2F), rule);
  EXPECT_LT(cv::norm(one, other, cv::NORM_INF), 1e-2);
}

TEST(BandRule, NothingAndTinyBandsStayFinite) {
  EXPECT_EQ(cv::norm(fuse_band(constant(0), constant(0), constant(0.5F), constant(1), rule),
                     cv::NORM_INF),
            0);
  const Plane one(1, 1, 5.0F), two(1, 1, -7.0F), half(1, 1, 0.5F);
  EXPECT_TRUE(cv::checkRange(fuse_band(one, two, half, half, rule)));
}

TEST(CnnLpif, OptionsOutOfRangeAreNamed) {
  const auto where = [](auto set) {
    CnnLpifOptions options;
    set(options);
    const Status status = options.validate();
    return status ? std::string("none") : status.error().where;
  };
  EXPECT_EQ(where([](auto& o) { o.vote_px = 4; }), "cnn_lpif.vote_px");
  EXPECT_EQ(where([](auto& o) { o.network_bands = -1; }), "cnn_lpif.network_bands");
  EXPECT_EQ(where([](auto& o) { o.network_halvings = 9; }), "cnn_lpif.network_halvings");
  EXPECT_EQ(where([](auto& o) { o.flat_within = 300; }), "cnn_lpif.flat_within");
  EXPECT_EQ(where([](auto& o) { o.match_threshold = std::numeric_limits<double>::quiet_NaN(); }),
            "cnn_lpif.match_threshold");
  EXPECT_EQ(where([](auto&) {}), "none");
}

TEST(CnnLpif, InvertedAndLargePairsStayNearTheSources) {
  const Plane v = dead_leaves({640, 480}, 7);
  const auto inverted = fuse_cnn_lpif(v, 255 - v, {});
  ASSERT_TRUE(inverted);
  double low = 0, high = 0;
  cv::minMaxLoc(*inverted, &low, &high);
  EXPECT_GT(low, -128);
  EXPECT_LT(high, 384);
  Plane a(3072, 4096, 10.0F), b = a.clone();
  b(100, 100) = 200;
  CnnLpifReport report;
  const auto large = fuse_cnn_lpif(a, b, {}, &report);
  ASSERT_TRUE(large);
  EXPECT_TRUE(cv::checkRange(*large));
  EXPECT_GT(report.patches_skipped, 0.999);
  EXPECT_NEAR((*large)(3000, 4000), 10, 1);
}

}  // namespace
}  // namespace orbitfuse::fusion
