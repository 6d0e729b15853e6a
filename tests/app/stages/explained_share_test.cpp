// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/explained_share.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

namespace orbitfuse::stages {
namespace {

constexpr double noise = 0.02;

cv::Mat image(int type, double mean, double sigma, int seed) {
  cv::Mat values(60, 80, type);
  cv::RNG rng(seed);
  rng.fill(values, cv::RNG::NORMAL, cv::Scalar::all(mean), cv::Scalar::all(sigma));
  return values;
}

TEST(ExplainedShare, IsOneLessTheErrorsShareOfTheVariance) {
  for (const int type : {CV_32FC1, CV_32FC3}) {
    const cv::Mat truth = image(type, 0.5, 0.2, 1);
    for (const double error : {0.0, 0.1, 0.2}) {
      ExplainedShare explained;
      for (int frame = 0; frame < 3; ++frame)
        explained.add(truth, truth + image(type, 0, error, 10 + frame));
      EXPECT_NEAR(explained.share(), 1 - error * error / 0.04, 0.04) << error;
      EXPECT_EQ(explained.is_poor(noise), error == 0.2) << error;
    }
  }
}

TEST(ExplainedShare, AFrameOfOneTemperatureWithTheCamerasNoiseIsNotPoor) {
  ExplainedShare explained;
  explained.add(image(CV_32FC1, 300, 0.04, 1), image(CV_32FC1, 300, 0.001, 2));
  EXPECT_LT(explained.share(), ExplainedShare::least);
  EXPECT_FALSE(explained.is_poor(0.5));
  EXPECT_TRUE(explained.is_poor(0.01));
}

TEST(ExplainedShare, LeavesOutWhatIsNoNumber) {
  const cv::Mat truth = image(CV_32FC1, 300, 5, 1);
  cv::Mat holed = truth.clone();
  holed.rowRange(0, 20).setTo(std::numeric_limits<float>::quiet_NaN());
  for (const auto& [a, b] : {std::pair(truth, holed), std::pair(holed, truth)}) {
    ExplainedShare explained;
    explained.add(a, b);
    EXPECT_NEAR(explained.share(), 1, 1e-9);
  }
}

TEST(ExplainedShare, SaysNothingOfNoFramesOrOfNoPixels) {
  ExplainedShare explained;
  EXPECT_TRUE(std::isnan(explained.share()));
  EXPECT_FALSE(explained.is_poor(0));
  const cv::Mat nothing(4, 4, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  explained.add(nothing, nothing);
  EXPECT_FALSE(explained.is_poor(0));
}

}  // namespace
}  // namespace orbitfuse::stages
