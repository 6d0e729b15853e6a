// SPDX-License-Identifier: BSD-3-Clause
#include "capture/image_quality/edge_blur.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "capture/guide/coverage.hpp"
#include "capture/image_quality/frame_motion.hpp"
#include "capture/image_quality/frame_quality.hpp"

namespace orbitfuse {
namespace {

/// Tilted squares, drawn four times as large and averaged: every direction has edges, sharp to a
/// pixel's own width.
cv::Mat squares(double low, double high) {
  cv::Mat large(4 * 240, 4 * 320, CV_32FC1, cv::Scalar(low)), image;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      const cv::RotatedRect square(cv::Point2f(160.0F + 320 * column, 160.0F + 320 * row),
                                   {190, 190}, static_cast<float>(15 * (4 * row + column)));
      cv::Point2f corners[4];
      square.points(corners);
      std::vector<cv::Point> polygon(corners, corners + 4);
      cv::fillConvexPoly(large, polygon, cv::Scalar(high));
    }
  }
  cv::resize(large, image, {}, 0.25, 0.25, cv::INTER_AREA);
  return image;
}

cv::Mat noisy(const cv::Mat& image, double sigma, std::uint64_t seed = 7) {
  cv::Mat noise(image.size(), CV_32FC1);
  cv::RNG random(seed);
  random.fill(noise, cv::RNG::NORMAL, 0, sigma);
  return image + noise;
}

TEST(EdgeBlur, TellsTheSigmaOfAGaussianBlur) {
  const cv::Mat sharp = squares(50, 200);
  const double own = measure_edge_blur(sharp).sigma_px;
  EXPECT_LT(own, 0.8);
  for (const double sigma : {1.0, 1.5, 2.0, 3.0, 4.0}) {
    cv::Mat blurred;
    cv::GaussianBlur(sharp, blurred, {}, sigma);
    EXPECT_NEAR(measure_edge_blur(blurred).sigma_px, std::hypot(sigma, own), 0.15 * sigma) << sigma;
  }
}

TEST(EdgeBlur, TellsMotionThoughEdgesAlongItStaySharp) {
  const cv::Mat sharp = squares(50, 200);
  for (const int length : {5, 9, 15}) {
    cv::Mat sideways, upwards;
    cv::blur(sharp, sideways, {length, 1});
    cv::blur(sharp, upwards, {1, length});
    // A box of that length has the standard deviation length / sqrt(12).
    EXPECT_GT(measure_edge_blur(sideways).sigma_px, 0.7 * length / std::sqrt(12)) << length;
    EXPECT_GT(measure_edge_blur(upwards).sigma_px, 0.7 * length / std::sqrt(12)) << length;
  }
}

TEST(EdgeBlur, SmallImagesHaveFewEdgesButEnough) {
  cv::Mat small, blurred;
  cv::resize(squares(50, 200)(cv::Rect(0, 0, 80, 80)), small, {}, 0.5, 0.5, cv::INTER_AREA);
  EXPECT_GT(measure_edge_blur(small).edges, 0);
  EXPECT_LT(measure_edge_blur(small).sigma_px, 1);
  cv::GaussianBlur(small, blurred, {}, 2);
  EXPECT_GT(measure_edge_blur(blurred).sigma_px, 1.75);
}

TEST(EdgeBlur, ScaleAndOffsetOfTheLevelsDoNotMatter) {
  const double usual = measure_edge_blur(squares(50, 200)).sigma_px;
  EXPECT_NEAR(measure_edge_blur(squares(0.001, 0.002)).sigma_px, usual, 0.05);
  EXPECT_NEAR(measure_edge_blur(squares(29000, 29300)).sigma_px, usual, 0.05);
  EXPECT_NEAR(measure_edge_blur(squares(1e9, 4e9)).sigma_px, usual, 0.05);
  EXPECT_NEAR(measure_edge_blur(200 - squares(50, 200)).sigma_px, usual, 0.05);
}

/// Contrast 3 K, noise of 50 to 300 mK (centikelvin here), the lens's own blur of one pixel.
TEST(EdgeBlur, NoisySharpThermalImagesPassAndBlurredOnesDoNot) {
  const CoverageOptions floors;
  cv::Mat soft, blurred;
  cv::GaussianBlur(squares(29300, 29600), soft, {}, 1);
  cv::GaussianBlur(soft, blurred, {}, 4);
  for (const double noise : {5.0, 15.0, 30.0}) {
    const EdgeBlur sharp = measure_edge_blur(noisy(soft, noise));
    EXPECT_GT(sharp.edges, 0) << noise;
    EXPECT_LT(sharp.sigma_px, floors.max_thermal_edge_px) << noise;
    const EdgeBlur wide = measure_edge_blur(noisy(blurred, noise));
    EXPECT_TRUE(wide.edges == 0 || wide.sigma_px > floors.max_thermal_edge_px)
        << noise << ": " << wide.sigma_px;
  }
}

TEST(EdgeBlur, NothingToSeeIsNoEdge) {
  const cv::Mat constant(240, 320, CV_32FC1, cv::Scalar(29300));
  EXPECT_EQ(measure_edge_blur(constant).edges, 0);
  EXPECT_EQ(measure_edge_blur(constant).sigma_px, 0);
  EXPECT_EQ(measure_edge_blur(cv::Mat(240, 320, CV_32FC1, cv::Scalar(0))).edges, 0);
  EXPECT_EQ(measure_edge_blur(cv::Mat(8, 200, CV_32FC1, cv::Scalar(1))).edges, 0);
  EXPECT_EQ(measure_edge_blur(cv::Mat(0, 0, CV_32FC1)).edges, 0);
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    EXPECT_EQ(measure_edge_blur(noisy(constant, 10, seed)).edges, 0) << seed;
}

TEST(EdgeBlur, DeadPixelsOfAThermalImageAreNoEdges) {
  cv::Mat blurred, image;
  cv::GaussianBlur(noisy(squares(29500, 30100), 8), blurred, {}, 4.5);
  blurred.convertTo(image, CV_16U);
  const double before = measure_edges(image).sigma_px;
  image(cv::Rect(60, 60, 10, 10)).setTo(0);
  image(cv::Rect(200, 20, 1, 200)).setTo(0);
  const EdgeBlur found = measure_edges(image);
  EXPECT_GT(found.edges, 0);
  EXPECT_NEAR(found.sigma_px, before, 0.1 * before);
  EXPECT_GT(found.sigma_px, CoverageOptions{}.max_thermal_edge_px);
  const cv::Mat none = cv::Mat::zeros(image.size(), CV_16U);
  EXPECT_EQ(measure_edges(none).edges, 0);
}

TEST(FrameMotion, DeadPixelsDoNotHideTheMotion) {
  cv::Mat a, b;
  squares(29500, 30100).convertTo(a, CV_16U);
  cv::Mat shifted(a.size(), CV_16U);
  a(cv::Rect(0, 0, 312, 240)).copyTo(shifted(cv::Rect(8, 0, 312, 240)));
  a(cv::Rect(0, 0, 8, 240)).copyTo(shifted(cv::Rect(0, 0, 8, 240)));
  const double seen = apparent_motion(a, shifted);
  for (cv::Mat* image : {&a, &shifted}) (*image)(cv::Rect(60, 60, 10, 10)).setTo(0);
  EXPECT_NEAR(apparent_motion(a, shifted), seen, 0.2 * seen);
}

TEST(FrameMotion, TellsTheShift) {
  cv::Mat scene;
  squares(60, 180).convertTo(scene, CV_8U);
  const auto moved = [&](double x, double y) {
    const cv::Mat way = (cv::Mat_<double>(2, 3) << 1, 0, x, 0, 1, y);
    cv::Mat image;
    cv::warpAffine(scene, image, way, scene.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    return image;
  };
  EXPECT_EQ(apparent_motion(scene, scene), 0);
  for (const double shift_px : {0.5, 1.0, 2.0, 4.0}) {
    EXPECT_NEAR(320 * apparent_motion(scene, moved(shift_px, 0)), shift_px, 0.3 * shift_px);
    EXPECT_NEAR(320 * apparent_motion(moved(0, shift_px), scene), shift_px, 0.3 * shift_px);
  }
  EXPECT_GT(apparent_motion(scene, moved(40, 25)), 0.01);
  EXPECT_LT(apparent_motion(scene, scene + 20), 1e-3);  // brighter is not moved
}

TEST(FrameMotion, NoiseAloneIsNoMotion) {
  cv::Mat a, b, moved;
  const cv::Mat scene = squares(29300, 29600);
  noisy(scene, 15, 1).convertTo(a, CV_16U);
  noisy(scene, 15, 2).convertTo(b, CV_16U);
  const cv::Mat way = (cv::Mat_<double>(2, 3) << 1, 0, 4, 0, 1, 0);
  cv::warpAffine(b, moved, way, b.size());
  EXPECT_LT(apparent_motion(a, b), 0.002);
  EXPECT_GT(apparent_motion(a, moved), 0.008);
  noisy(cv::Mat(240, 320, CV_32FC1, cv::Scalar(29300)), 15, 1).convertTo(a, CV_16U);
  noisy(cv::Mat(240, 320, CV_32FC1, cv::Scalar(29300)), 15, 2).convertTo(b, CV_16U);
  EXPECT_TRUE(std::isfinite(apparent_motion(a, b)));
  const cv::Mat constant(240, 320, CV_8UC3, cv::Scalar::all(7));
  EXPECT_EQ(apparent_motion(constant, constant), 0);
}

}  // namespace
}  // namespace orbitfuse
