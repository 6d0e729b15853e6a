// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/luminance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse {
namespace {

cv::Mat1f ramp() {
  cv::Mat1f image(40, 50);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 50; ++x) image(y, x) = 285 + 0.4F * static_cast<float>(x);
  return image;
}

/// A uniform slope of values is its own ranks.
TEST(Equalised, ASlopeStaysASlope) {
  const cv::Mat1f image = ramp();
  const cv::Mat1f ranks = equalised(image);
  double low = 0, high = 0;
  cv::minMaxLoc(image, &low, &high);
  for (const cv::Point p : {cv::Point(0, 0), cv::Point(20, 30), cv::Point(49, 3)})
    EXPECT_NEAR(ranks(p), (image(p) - low) / (high - low), 0.02);
}

TEST(Equalised, AFlameDoesNotDrownTheWall) {
  cv::Mat1f image = ramp();
  image(cv::Rect(5, 5, 8, 8)) = 1173;
  image(6, 6) = 1200;
  const cv::Mat1f ranks = equalised(image);
  EXPECT_GT(ranks(0, 49) - ranks(0, 0), 0.65) << "the wall keeps its range";
  EXPECT_GT(ranks(5, 5), ranks(0, 49)) << "the order is kept";
  EXPECT_GE(ranks(6, 6), ranks(5, 5));
  EXPECT_EQ(image(5, 5), 1173) << "the image itself is";
}

/// Half of the pixels at 290 K, half at 300, each with a noise of 40 mK: by ranks alone noise would
/// fill all of the range.
TEST(Equalised, NoiseOfPlainSurfacesStaysSmall) {
  cv::Mat1f image(80, 80);
  cv::RNG random(3);
  random.fill(image, cv::RNG::NORMAL, 290, 0.04);
  image(cv::Rect(40, 0, 40, 80)) += 10;
  const cv::Mat1f ranks = equalised(image);
  cv::Scalar cold, cold_noise, hot, hot_noise;
  cv::meanStdDev(ranks(cv::Rect(0, 0, 38, 80)), cold, cold_noise);
  cv::meanStdDev(ranks(cv::Rect(42, 0, 38, 80)), hot, hot_noise);
  EXPECT_NEAR(cold_noise[0], 0.014, 0.005);
  EXPECT_NEAR(hot_noise[0], 0.014, 0.005);
  EXPECT_GT(hot[0] - cold[0], 20 * cold_noise[0]);
}

/// Two levels that differ by rounding alone are no edge.
TEST(Equalised, RoundingIsNoEdge) {
  cv::Mat1f image(60, 60, 100.0F);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 60; ++x) image(y, x) += static_cast<float>((x * 7 + y * 13) % 2);
  image(cv::Rect(30, 0, 30, 60)) += 80;
  const cv::Mat1f ranks = equalised(image);
  EXPECT_GT(ranks(5, 55) - ranks(5, 5), 5 * std::abs(ranks(5, 5) - ranks(5, 6)));
}

TEST(Equalised, NothingAndNanAreNoTrouble) {
  const cv::Mat invalid(10, 10, CV_32F, cv::Scalar(std::nan("")));
  EXPECT_TRUE(std::isnan(equalised(invalid).at<float>(3, 3)));
  EXPECT_TRUE(equalised(cv::Mat(0, 0, CV_32F)).empty());
  const cv::Mat constant(20, 20, CV_32F, cv::Scalar(300));
  EXPECT_EQ(cv::norm(equalised(constant), cv::NORM_INF), 0);
  cv::Mat1f image = ramp();
  image(0, 0) = std::nanf("");
  image(1, 1) = 1e30F;
  image(2, 2) = -std::numeric_limits<float>::infinity();
  const cv::Mat1f ranks = equalised(image);
  EXPECT_TRUE(std::isnan(ranks(0, 0)));
  EXPECT_GT(ranks(1, 1), 0.9);
  EXPECT_LT(ranks(1, 1), 1.1);
  for (const float v : ranks) EXPECT_TRUE(!(std::abs(v) > 1.1F) || std::isinf(v));
}

}  // namespace
}  // namespace orbitfuse
