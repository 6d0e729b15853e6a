// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/thermal_depth.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/patterned_floor.hpp"

namespace orbitfuse {
namespace {

/// The floor in kelvin with a camera's noise, a row of dead pixels and a flame.
nerf::Dataset warm_floor(const depth::test::World& world) {
  nerf::Dataset data;
  data.modality = Modality::thermal;
  cv::RNG random(3);
  for (std::size_t i = 0; i < world.images.size(); ++i) {
    const PosedView& view = world.model.views[i];
    cv::Mat kelvin, noise(world.images[i].size(), CV_32FC1);
    world.images[i].convertTo(kelvin, CV_32F, 0.05, 288);
    random.fill(noise, cv::RNG::NORMAL, 0, 0.06);
    kelvin += noise;
    kelvin.row(20).setTo(std::numeric_limits<float>::quiet_NaN());
    kelvin.at<float>(60, 40) = 900;
    data.views.push_back({view.name, view.camera, view.cam_from_world, kelvin});
  }
  return data;
}

TEST(ThermalDepth, IsFoundInNoisyTemperaturesOfTheViewsThatTrain) {
  const depth::test::World world = depth::test::arc(5, 15);
  nerf::Dataset data = warm_floor(world);
  const auto found = add_thermal_depth(data, 120, 4, 1, {});  // views 0 and 4 measure
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_GT(found->known, 0.4);
  EXPECT_FALSE(found->problem) << *found->problem;
  ASSERT_EQ(data.depth.size(), 3u);
  EXPECT_TRUE(data.validate());
  double good = 0, all = 0;
  for (const DepthMap& map : data.depth) {
    EXPECT_TRUE(map.view >= 1 && map.view <= 3) << map.view;
    const cv::Mat& truth = world.truth[static_cast<std::size_t>(map.view)];
    for (int y = 0; y < map.depth.rows; ++y)
      for (int x = 0; x < map.depth.cols; ++x) {
        const float z = map.depth.at<float>(y, x);
        if (!std::isfinite(z)) continue;
        ++all;
        good += std::abs(z / truth.at<float>(y * truth.rows / map.depth.rows,
                                             x * truth.cols / map.depth.cols) -
                         1) < 0.03;
      }
  }
  EXPECT_GT(good / all, 0.9);
}

TEST(ThermalDepth, WithoutParallaxThereIsNoneAndTrainingGoesOn) {
  depth::test::World world = depth::test::arc(3, 15);
  nerf::Dataset data = warm_floor(world);
  for (nerf::TrainingView& view : data.views) view.cam_from_world = data.views[0].cam_from_world;
  const auto found = add_thermal_depth(data, 120, 0, 1, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->known, 0);
  EXPECT_TRUE(found->problem);
  EXPECT_FALSE(data.has_dense_depth());
}

TEST(ThermalDepth, IsNotMatchedInViewsThatTrainingDropsOrMeasures) {
  const depth::test::World world = depth::test::arc(9, 8);
  nerf::Dataset data = warm_floor(world);
  data.views[1].image.setTo(std::numeric_limits<float>::quiet_NaN());
  const auto found = add_thermal_depth(data, 64, 4, 1,
                                       {});  // of the eight others, the first and the fifth measure
  ASSERT_TRUE(found) << found.error().message();
  std::vector<int> views;
  for (const DepthMap& map : data.depth) views.push_back(map.view);
  EXPECT_EQ(views, (std::vector<int>{2, 3, 4, 6, 7, 8}));
}

TEST(ThermalDepth, ImagesTooSmallToMatchAreNoError) {
  nerf::Dataset data = warm_floor(depth::test::arc(3, 15));
  for (nerf::TrainingView& view : data.views) view = nerf::resized(view, 16, 12);
  const auto found = add_thermal_depth(data, 260, 0, 1, {});
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_TRUE(found->problem);
}

}  // namespace
}  // namespace orbitfuse
