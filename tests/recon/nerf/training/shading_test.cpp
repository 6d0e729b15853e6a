// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/shading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "recon/nerf/training/measure.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int shaded_views = 12;

/// Each view with a drift of its own, and what the lens adds to all. Views look beside the ball,
/// each elsewhere: of a ball in the middle the angle would tell as much as the place in the image.
Dataset shaded_scene(double falloff_k, int views = shaded_views, bool beside = true) {
  constexpr int side = 96;
  Dataset data = test::toy_scene(Modality::thermal, views, 1, 128);
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    TrainingView& view = data.views[i];
    const int x = beside ? static_cast<int>(i * 13 % 33) : 16,
              y = beside ? static_cast<int>(i * 7 % 33) : 16;
    view.image = view.image(cv::Rect(x, y, side, side)).clone();
    view.camera.width = view.camera.height = side;
    view.camera.cx -= x;
    view.camera.cy -= y;
    view.image = view.image + shading_image(falloff_k, view.image.size()) +
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

TEST(Shading, IsNotTakenForTheAngleWhereOneTellsTheOther) {
  const Shading shading = shading_of(shaded_scene(-1, shaded_views, false));
  EXPECT_LT(shading.alone, 0.1);
  EXPECT_FALSE(shading.told());
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
    for (int y = 0; y < view.image.rows; y += 17)
      for (int x = 0; x < view.image.cols; x += 19)
        view.image.at<float>(y, x) = std::numeric_limits<float>::quiet_NaN();
  const Shading shading = shading_of(data);
  EXPECT_TRUE(shading.told());
  EXPECT_NEAR(shading.falloff_k, -0.5, 0.15);
  for (TrainingView& view : data.views) view.image.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(shading_of(data).told());
}

TEST(Shading, IsFoundFromHundredsOfViewsToo) {
  const Shading shading = shading_of(shaded_scene(-0.6, 150));
  EXPECT_TRUE(shading.told());
  EXPECT_NEAR(shading.falloff_k, -0.6, 0.16);
  EXPECT_LT(shading.points, 40000);
}

CurvePoint measured(double psnr) {
  CurvePoint point{};
  point.heldout_psnr = psnr;
  return point;
}

TEST(HeldOut, FallsOnlyBeyondWhatViewsVary) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(fell({}));
  EXPECT_FALSE(fell({measured(20)}));
  EXPECT_FALSE(fell({measured(20), measured(22)}));
  EXPECT_FALSE(fell({measured(22), measured(21.8)}));
  EXPECT_TRUE(fell({measured(22), measured(21.6)}));
  EXPECT_TRUE(fell({measured(22), measured(21.8), measured(21.6)})) << "steps don't add up";
  EXPECT_TRUE(fell({measured(22), measured(nan)}));
  EXPECT_TRUE(fell({measured(nan)}));
  EXPECT_FALSE(fell({measured(nan), measured(20)}));
  EXPECT_EQ(peak_db({measured(nan), measured(20), measured(19)}), 20);
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
