// SPDX-License-Identifier: BSD-3-Clause
#include "capture/image_quality/frame_quality.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace orbitfuse {
namespace {

cv::Mat checkers(int type, double low, double high) {
  cv::Mat image(240, 320, type, cv::Scalar::all(low));
  for (int y = 0; y < 240; y += 16) {
    for (int x = (y / 16 % 2) * 16; x < 320; x += 32)
      image(cv::Rect(x, y, 16, 16)).setTo(cv::Scalar::all(high));
  }
  return image;
}

TEST(FrameQuality, BlurLowersSharpnessAndContrastDoesNotChangeIt) {
  const cv::Mat sharp = checkers(CV_8UC3, 50, 200);
  cv::Mat blurred, very;
  cv::GaussianBlur(sharp, blurred, {}, 1.5);
  cv::GaussianBlur(sharp, very, {}, 4);
  const double a = measure_quality(sharp).sharpness, b = measure_quality(blurred).sharpness;
  EXPECT_GT(a, 2 * b);
  EXPECT_GT(b, 2 * measure_quality(very).sharpness);
  EXPECT_NEAR(measure_quality(checkers(CV_8UC1, 100, 140)).sharpness, a, 0.02 * a);
  EXPECT_NEAR(measure_quality(checkers(CV_16UC1, 29000, 29400)).sharpness, a, 0.02 * a);
}

TEST(FrameQuality, LongThinImagesHaveADefinedAnswer) {
  const cv::Mat image(8, 20000, CV_8UC1, cv::Scalar(90));
  EXPECT_EQ(measure_quality(image).sharpness, 0);
  EXPECT_EQ(measure_edges(image).edges, 0);
}

TEST(FrameQuality, LevelsAndClipping) {
  EXPECT_NEAR(measure_quality(cv::Mat(8, 8, CV_8UC1, cv::Scalar(255))).clipped_fraction, 1, 1e-12);
  EXPECT_EQ(measure_quality(cv::Mat(8, 8, CV_8UC1, cv::Scalar(255))).sharpness, 0);
  cv::Mat thermal(10, 10, CV_16UC1, cv::Scalar(30000));
  thermal.row(0).setTo(0);
  const FrameQuality q = measure_quality(thermal);
  EXPECT_NEAR(q.mean_level, 300, 1e-9);
  EXPECT_NEAR(q.clipped_fraction, 0.1, 1e-12);
}

}  // namespace
}  // namespace orbitfuse
