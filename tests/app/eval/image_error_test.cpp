// SPDX-License-Identifier: BSD-3-Clause
#include "app/eval/image_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse::eval {
namespace {

cv::Mat1f warm_slope() {
  cv::Mat1f kelvin(20, 512);
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
  EXPECT_EQ(pairs.level.size(), static_cast<std::size_t>(20 * 510));
  EXPECT_NEAR(level_error(pairs).rank_correlation, 1, 1e-6);
}

TEST(LevelError, NothingOrOneLevelIsNoFigure) {
  EXPECT_TRUE(std::isnan(level_error({}).mae_k));
  LevelPairs pairs;
  pairs.add(cv::Mat1f(4, 4, 7.0F), cv::Mat1f(4, 4, 300.0F), 273);
  EXPECT_TRUE(std::isnan(level_error(pairs).rank_correlation));
  EXPECT_TRUE(std::isnan(level_error(pairs).mae_k));
}

}  // namespace
}  // namespace orbitfuse::eval
