// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/luminance.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace orbitfuse {
namespace {

cv::Mat1f ramp() {
  cv::Mat1f image(40, 50);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 50; ++x) image(y, x) = 285 + 0.4F * static_cast<float>(x);
  return image;
}

TEST(WithoutGlare, OrdinaryScenesStayAsTheyAre) {
  const cv::Mat1f image = ramp();
  EXPECT_EQ(cv::norm(without_glare(image), image, cv::NORM_INF), 0);
  const cv::Mat constant(20, 20, CV_32F, cv::Scalar(300));
  EXPECT_EQ(cv::norm(without_glare(constant), constant, cv::NORM_INF), 0);
}

TEST(WithoutGlare, AFlameDoesNotDrownTheWall) {
  cv::Mat1f image = ramp();
  image(cv::Rect(5, 5, 8, 8)) = 1173;
  image(6, 6) = 1200;
  const cv::Mat1f calm = without_glare(image);
  EXPECT_LT(calm(5, 5), 900);
  EXPECT_GT(calm(5, 5), calm(0, 49));
  EXPECT_GT(calm(6, 6), calm(5, 5)) << "the order is kept";
  EXPECT_EQ(calm(30, 20), image(30, 20));
  EXPECT_EQ(image(5, 5), 1173) << "the image itself is";
}

TEST(WithoutGlare, NothingAndNanAreNoTrouble) {
  const cv::Mat invalid(10, 10, CV_32F, cv::Scalar(std::nan("")));
  EXPECT_TRUE(std::isnan(without_glare(invalid).at<float>(3, 3)));
  EXPECT_TRUE(without_glare(cv::Mat(0, 0, CV_32F)).empty());
  cv::Mat1f image = ramp();
  image(0, 0) = std::nanf("");
  image(1, 1) = 2000;
  EXPECT_TRUE(std::isnan(without_glare(image).at<float>(0, 0)));
  EXPECT_TRUE(std::isfinite(without_glare(image).at<float>(1, 1)));
}

}  // namespace
}  // namespace orbitfuse
