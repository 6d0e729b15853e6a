// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/shading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int shaded_views = 12;

/// Each view with a drift of its own, and what the lens adds to all.
Dataset shaded_scene(double falloff_k) {
  Dataset data = test::toy_scene(Modality::thermal, shaded_views, 1, 128);
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    cv::Mat& image = data.views[i].image;
    image = image + shading_image(falloff_k, image.size()) +
            0.2 * std::sin(3.0 * static_cast<double>(i));
  }
  return data;
}

Shading shading_of(const Dataset& data) { return estimate_shading(data, test::toy_depth(data)); }

TEST(Shading, GrowsWithTheSquareOfTheDistanceFromTheMiddle) {
  const cv::Mat image = shading_image(-0.5, {80, 60});
  EXPECT_NEAR(image.at<float>(30, 40), 0, 1e-3);
  EXPECT_NEAR(image.at<float>(30, 79), -0.5, 0.02);
  EXPECT_NEAR(image.at<float>(30, 60), -0.125, 0.01);
  EXPECT_NEAR(image.at<float>(59, 40), -0.5 * 30 * 30 / 40 / 40, 0.02);
  EXPECT_LT(image.at<float>(0, 0), -0.7);
}

TEST(Shading, IsFoundBesideTheFramesDrift) {
  for (const double falloff_k : {-1.5, -0.5, 0.8}) {
    const Shading shading = shading_of(shaded_scene(falloff_k));
    EXPECT_TRUE(shading.told()) << falloff_k;
    EXPECT_NEAR(shading.falloff_k, falloff_k, 0.1 + 0.1 * std::abs(falloff_k));
    EXPECT_GT(shading.points, 300);
  }
}

TEST(Shading, OfALensWithoutAnyIsNotTold) {
  const Shading shading = shading_of(shaded_scene(0));
  EXPECT_FALSE(shading.told()) << shading.falloff_k << " +- " << shading.sigma_k;
}

TEST(Shading, OfFramesThatShareNothingIsNotTold) {
  Dataset data = shaded_scene(-1);
  EXPECT_FALSE(estimate_shading(data, {}).told());
  data.views.resize(1);
  EXPECT_FALSE(shading_of(data).told());
  EXPECT_FALSE(Shading{}.told());
}

TEST(Shading, DeadPixelsHaveNoSay) {
  Dataset data = shaded_scene(-0.5);
  for (TrainingView& view : data.views)
    for (int y = 0; y < view.image.rows; y += 7)
      for (int x = 0; x < view.image.cols; x += 5)
        view.image.at<float>(y, x) = std::numeric_limits<float>::quiet_NaN();
  const Shading shading = shading_of(data);
  EXPECT_TRUE(!shading.told() || std::abs(shading.falloff_k + 0.5) < 0.15) << shading.falloff_k;
  for (TrainingView& view : data.views) view.image.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(shading_of(data).told());
}

TEST(Shading, OfWildFramesIsRefused) {
  EXPECT_FALSE(shading_of(shaded_scene(-40)).told()) << "no lens does that";
}

TEST(Shading, IsTheSameForTheSameFrames) {
  const Dataset data = shaded_scene(-0.5);
  EXPECT_EQ(shading_of(data).falloff_k, shading_of(data).falloff_k);
}

}  // namespace
}  // namespace orbitfuse::nerf
