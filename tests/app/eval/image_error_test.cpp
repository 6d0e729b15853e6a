// SPDX-License-Identifier: BSD-3-Clause
#include "app/eval/image_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse::eval {
namespace {

cv::Mat1f warm_slope() {
  cv::Mat1f kelvin(60, 512);
  for (int y = 0; y < kelvin.rows; ++y)
    for (int x = 0; x < kelvin.cols; ++x) kelvin(y, x) = 280 + 0.05F * static_cast<float>(x);
  return kelvin;
}

TEST(LevelError, AnyRisingCurveOfTheTruthIsRight) {
  const cv::Mat1f truth = warm_slope();
  cv::Mat1f levels = truth.clone();
  for (float& v : levels) v = 0.01F * std::pow(v - 279, 3.0F);
  LevelPairs pairs;
  pairs.add(levels, truth, 273);
  const LevelError error = level_error(pairs);
  EXPECT_NEAR(error.rank_correlation, 1, 1e-6);
  EXPECT_LT(error.mae_k, 0.06) << "what 256 groups of levels hold each";
}

/// Two views whose levels mean other temperatures: a surface of either is off by half of what the
/// curves differ by.
TEST(LevelError, ViewsThatDisagreeAreOff) {
  const cv::Mat1f truth = warm_slope();
  LevelPairs pairs;
  pairs.add(truth - 280, truth, 273);
  pairs.add(truth - 276, truth, 273);
  const LevelError error = level_error(pairs);
  EXPECT_LT(error.rank_correlation, 0.98);
  EXPECT_NEAR(error.mae_k, 2, 0.4);
}

TEST(LevelError, SkyAndWhatIsUnknownDoNotCount) {
  const cv::Mat1f truth = warm_slope();
  cv::Mat1f levels = truth - 280, seen = truth.clone();
  levels.col(3) = std::numeric_limits<float>::quiet_NaN();
  seen.col(7) = 250;
  LevelPairs pairs;
  pairs.add(levels, seen, 273);
  EXPECT_EQ(pairs.level.size(), static_cast<std::size_t>(60 * 510));
  EXPECT_NEAR(level_error(pairs).rank_correlation, 1, 1e-6);
  EXPECT_NEAR(level_error(pairs).covered, 510.0 / 511, 1e-9) << "the sky is no scene";
}

TEST(LevelError, LevelsThatMeanNothingAreOffByAsMuchAsTemperaturesVary) {
  cv::RNG rng(3);
  for (const int pixels : {120, 256, 1000, 20000}) {
    cv::Mat1f truth(1, pixels), levels(1, pixels);
    rng.fill(truth, cv::RNG::UNIFORM, 290, 294);  // its mean deviation: 1 K
    rng.fill(levels, cv::RNG::UNIFORM, 0, 255);
    LevelPairs pairs;
    pairs.add(levels, truth, 273);
    EXPECT_NEAR(level_error(pairs).mae_k, 1, 0.12) << pixels;
  }
  LevelPairs few;
  few.add(cv::Mat1f(1, 99, 5.0F), cv::Mat1f(1, 99, 300.0F), 273);
  EXPECT_TRUE(std::isnan(level_error(few).mae_k));
}

TEST(LevelError, EqualLevelsStandForOneTemperature) {
  cv::Mat1f truth(2, 10000), levels(2, 10000);
  for (int x = 0; x < truth.cols; ++x)
    for (int y = 0; y < 2; ++y) {
      levels(y, x) = static_cast<float>(100 * y);
      truth(y, x) = 300 + static_cast<float>(10 * y + (x % 2) * 5);
    }
  LevelPairs pairs;
  pairs.add(levels, truth, 273);
  EXPECT_NEAR(level_error(pairs).mae_k, 2.5, 1e-6);
}

TEST(LevelError, NothingOrOneLevelIsNoFigure) {
  EXPECT_TRUE(std::isnan(level_error({}).mae_k));
  LevelPairs pairs;
  pairs.add(cv::Mat1f(40, 40, 7.0F), cv::Mat1f(40, 40, 300.0F), 273);
  EXPECT_TRUE(std::isnan(level_error(pairs).rank_correlation));
  EXPECT_TRUE(std::isnan(level_error(pairs).mae_k));
}

}  // namespace
}  // namespace orbitfuse::eval
