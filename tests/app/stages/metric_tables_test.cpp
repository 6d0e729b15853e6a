// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/metric_tables.hpp"

#include <gtest/gtest.h>

namespace orbitfuse::stages {
namespace {

double value_of(const std::vector<MetricValue>& values, const std::string& name) {
  for (const MetricValue& value : values)
    if (value.name == name) return value.value;
  ADD_FAILURE() << name;
  return 0;
}

/// Two images and the same with as much again of dead pixels, which both have as black.
TEST(MetricTables, DeadPixelsSayNothing) {
  cv::RNG rng(1);
  cv::Mat truth(64, 96, CV_8U), rendered;
  rng.fill(truth, cv::RNG::UNIFORM, 40, 200);
  cv::Mat noise(truth.size(), CV_8U);
  rng.fill(noise, cv::RNG::UNIFORM, 0, 12);
  rendered = truth + noise;
  const auto alone = render_metrics(truth, rendered);
  ASSERT_TRUE(alone);
  const cv::Mat dead(truth.size(), CV_8U, cv::Scalar(0));
  cv::Mat wide_truth, wide_rendered;
  cv::hconcat(truth, dead, wide_truth);
  cv::hconcat(rendered, dead, wide_rendered);
  auto wide = render_metrics(wide_truth, wide_rendered);
  ASSERT_TRUE(wide);
  EXPECT_GT(value_of(*wide, "PSNR"), value_of(*alone, "PSNR") + 3);
  take_out_alike(0.5, *wide);
  EXPECT_NEAR(value_of(*wide, "PSNR"), value_of(*alone, "PSNR"), 1e-9);
  EXPECT_NEAR(value_of(*wide, "hist"), value_of(*alone, "hist"), 1e-9);
  EXPECT_NEAR(value_of(*wide, "SSIM"), value_of(*alone, "SSIM"), 0.02) << "but for windows across";
}

}  // namespace
}  // namespace orbitfuse::stages
