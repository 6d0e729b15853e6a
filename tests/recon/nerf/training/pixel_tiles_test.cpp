// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/pixel_tiles.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>

namespace orbitfuse::nerf {
namespace {

/// Views that show `targets`.
std::vector<NormalisedView> views_of(const std::vector<cv::Mat>& targets) {
  std::vector<NormalisedView> views;
  for (const cv::Mat& target : targets) views.push_back({"", {}, target, {}, {}});
  return views;
}

cv::Mat checkered(int width, int height, int from_x) {
  cv::Mat image(height, width, CV_32FC3, cv::Scalar::all(0.5));
  for (int y = 0; y < height; ++y)
    for (int x = from_x; x < width; ++x)
      image.at<cv::Vec3f>(y, x) = cv::Vec3f::all((x + y) % 2 == 0 ? 0.0F : 1.0F);
  return image;
}

DrawnPixel drawn(const PixelTiles& tiles, std::uint64_t ray) {
  return pixel_at(tiles.view(), pixel_bits(1, ray, 0, 0));
}

TEST(PixelTiles, EveryStretchOfRaysLiesEvenlyOverAllViews) {
  const std::vector<cv::Mat> same(10, cv::Mat(30, 37, CV_32FC1, cv::Scalar(0.3)));
  const PixelTiles tiles = PixelTiles::of(views_of(same), std::vector<bool>(10, false), 0.5);
  for (const std::uint64_t first : {0U, 777U, 1U << 30}) {
    std::map<int, int> rays;
    for (unsigned i = 0; i < 1000; ++i) ++rays[drawn(tiles, first + i).view];
    for (int view = 0; view < 10; ++view) EXPECT_NEAR(rays[view], 100, 3) << first;
  }
}

TEST(PixelTiles, EveryPixelIsDrawnOnceBeforeAnyIsDrawnMuchMoreOften) {
  const PixelTiles tiles =
      PixelTiles::of(views_of({cv::Mat(30, 37, CV_32FC1, cv::Scalar(0.3))}), {false}, 0.5);
  std::map<std::pair<int, int>, int> rays;
  for (unsigned i = 0; i < 4 * 30 * 37; ++i) {
    const DrawnPixel pixel = drawn(tiles, i);
    ASSERT_TRUE(pixel.x >= 0 && pixel.x < 37 && pixel.y >= 0 && pixel.y < 30);
    ++rays[{pixel.x, pixel.y}];
  }
  EXPECT_EQ(rays.size(), 30 * 37U);
  for (const auto& [pixel, count] : rays) EXPECT_NEAR(count, 4, 2);
}

TEST(PixelTiles, TextureGetsMoreRaysAndNothingIsLeftOut) {
  const auto views = views_of({checkered(64, 64, 32)});
  const auto share_of_texture = [&](double texture_share) {
    const PixelTiles tiles = PixelTiles::of(views, {false}, texture_share);
    int textured = 0;
    for (unsigned i = 0; i < 10000; ++i) textured += drawn(tiles, i).x >= 32 ? 1 : 0;
    return textured / 10000.0;
  };
  EXPECT_NEAR(share_of_texture(0), 0.5, 0.01);
  EXPECT_NEAR(share_of_texture(0.5), 0.75, 0.01);  // half of the draw is even
}

TEST(PixelTiles, OneSharpOutlineDoesNotTakeAllRays) {
  cv::Mat image(160, 160, CV_32FC1, cv::Scalar(0));
  image.at<float>(3, 3) = 1e6F;
  const PixelTiles tiles = PixelTiles::of(views_of({image}), {false}, 1);
  EXPECT_EQ(tiles.tiles.front().weight, 4000U);
}

TEST(PixelTiles, WhatShowsNothingOrIsHeldOutIsNotDrawn) {
  constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
  cv::Mat half = checkered(64, 64, 0);
  half.colRange(0, 32).setTo(cv::Scalar::all(nothing));
  const PixelTiles tiles =
      PixelTiles::of(views_of({half, checkered(64, 64, 0)}), {false, true}, 0.5);
  for (unsigned i = 0; i < 1000; ++i) {
    const DrawnPixel pixel = drawn(tiles, i);
    EXPECT_EQ(pixel.view, 0);
    EXPECT_GE(pixel.x, 32);
  }
  // Without a value anywhere there is still something to draw, which the trainer passes over.
  half.setTo(cv::Scalar::all(nothing));
  EXPECT_FALSE(PixelTiles::of(views_of({half}), {false}, 0.5).tiles.empty());
}

TEST(PixelTiles, EndsOfTheDrawAreTheFirstAndTheLastPixel) {
  const PixelTiles tiles = PixelTiles::of(views_of({checkered(37, 30, 0)}), {false}, 0.5);
  const DrawnPixel first = pixel_at(tiles.view(), 0), last = pixel_at(tiles.view(), ~0ULL);
  EXPECT_EQ(std::pair(first.x, first.y), std::pair(0, 0));
  EXPECT_EQ(std::pair(last.x, last.y), std::pair(36, 29));
}

}  // namespace
}  // namespace orbitfuse::nerf
