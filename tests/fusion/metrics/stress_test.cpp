// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "core/system/parallel.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse {
namespace {

cv::Mat noise(int width, int height, int seed = 1, int type = CV_8UC1) {
  cv::RNG random(static_cast<std::uint64_t>(seed));
  cv::Mat image(height, width, type);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

cv::Mat checkerboard(int width, int height) {
  cv::Mat1b image(height, width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(y, x) = (x + y) % 2 ? 255 : 0;
  }
  return image;
}

double value(const std::vector<MetricValue>& values, const std::string& name) {
  for (const MetricValue& m : values) {
    if (m.name == name) return m.value;
  }
  ADD_FAILURE() << "no metric " << name;
  return std::nan("");
}

TEST(MetricsStress, EveryValueIsFinite) {
  const cv::Mat black = cv::Mat::zeros(40, 33, CV_8UC1), white(40, 33, CV_8UC1, cv::Scalar(255)),
                gray(40, 33, CV_8UC1, cv::Scalar(77));
  cv::Mat one_pixel = gray.clone();
  one_pixel.at<std::uint8_t>(20, 11) = 78;
  const cv::Mat random = noise(33, 40);
  const std::vector<cv::Mat> images{
      black, white, gray, one_pixel, random, 255 - random, checkerboard(33, 40)};
  for (const cv::Mat& v : images) {
    for (const cv::Mat& i : images) {
      for (const cv::Mat& f : images) {
        const auto values = fusion_metrics(v, i, f);
        ASSERT_TRUE(values);
        for (const MetricValue& m : *values) EXPECT_TRUE(std::isfinite(m.value)) << m.name;
      }
    }
  }
}

TEST(MetricsStress, IdenticalImagesScoreBest) {
  const cv::Mat image = noise(64, 48);
  const auto values = fusion_metrics(image, image, image);
  ASSERT_TRUE(values);
  EXPECT_NEAR(value(*values, "SSIM"), 1, 1e-12);
  EXPECT_DOUBLE_EQ(value(*values, "PSNR"), metrics::identical_psnr_db);
  EXPECT_DOUBLE_EQ(value(*values, "RMSE"), 0);
  EXPECT_NEAR(value(*values, "CC"), 1, 1e-12);
  EXPECT_NEAR(value(*values, "Qcb"), 1, 1e-9);
  EXPECT_NEAR(value(*values, "Qcv"), 0, 1e-9);
  EXPECT_NEAR(value(*values, "CE"), 0, 1e-12);
}

TEST(MetricsStress, ConstantImagesHaveDefinedAnswers) {
  const cv::Mat gray(32, 32, CV_8UC1, cv::Scalar(100));
  const auto values = fusion_metrics(gray, gray, gray);
  ASSERT_TRUE(values);
  EXPECT_EQ(value(*values, "EN"), 0);
  EXPECT_EQ(value(*values, "MI"), 0);
  EXPECT_EQ(value(*values, "SD"), 0);
  EXPECT_EQ(value(*values, "CC"), 0);
}

TEST(MetricsStress, AllSizesFrom16AndColour) {
  for (const cv::Size size : {cv::Size(16, 16), {17, 31}, {640, 16}, {127, 129}}) {
    const auto values = fusion_metrics(noise(size.width, size.height, 1, CV_8UC3),
                                       noise(size.width, size.height, 2),
                                       noise(size.width, size.height, 3, CV_8UC3));
    ASSERT_TRUE(values) << size;
    for (const MetricValue& m : *values) EXPECT_TRUE(std::isfinite(m.value)) << m.name << size;
  }
}

TEST(MetricsStress, SixteenBitsAreScaled) {
  const cv::Mat v = noise(32, 32, 1), i = noise(32, 32, 2), f = noise(32, 32, 3);
  cv::Mat v16, i16, f16;
  v.convertTo(v16, CV_16U, 257);
  i.convertTo(i16, CV_16U, 257);
  f.convertTo(f16, CV_16U, 257);
  const auto a = fusion_metrics(v, i, f), b = fusion_metrics(v16, i16, f16);
  ASSERT_TRUE(a && b);
  for (std::size_t m = 0; m < a->size(); ++m)
    EXPECT_NEAR((*a)[m].value, (*b)[m].value, 1e-8 * std::abs((*a)[m].value) + 1e-10)
        << (*a)[m].name;
}

TEST(MetricsStress, SameForAnyNumberOfThreads) {
  const cv::Mat v = noise(123, 77, 1), i = noise(123, 77, 2), f = noise(123, 77, 3);
  set_thread_count(1);
  const auto one = fusion_metrics(v, i, f);
  set_thread_count(4);
  const auto four = fusion_metrics(v, i, f);
  set_thread_count(0);
  ASSERT_TRUE(one && four);
  for (std::size_t m = 0; m < one->size(); ++m)
    EXPECT_EQ((*one)[m].value, (*four)[m].value) << (*one)[m].name;
}

TEST(MetricsStress, BadInputIsNamed) {
  const cv::Mat good = noise(32, 32);
  EXPECT_EQ(fusion_metrics(good, noise(33, 32), good).error().where, "thermal");
  EXPECT_EQ(fusion_metrics(good, good, cv::Mat()).error().where, "fused");
  EXPECT_FALSE(fusion_metrics(noise(15, 40), noise(15, 40), noise(15, 40)));
  cv::Mat nan(32, 32, CV_32FC1, cv::Scalar(1));
  nan.at<float>(3, 3) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(fusion_metrics(nan, good, good).error().where, "visible");
  EXPECT_FALSE(render_metrics(good, noise(32, 31)));
  EXPECT_FALSE(fusion_metrics(cv::Mat(32, 32, CV_8UC2), good, good));
}

TEST(MetricsStress, TemperatureErrorSkipsInvalid) {
  cv::Mat1f truth(4, 4, 300.0f), seen(4, 4, 301.0f);
  truth(0, 0) = std::numeric_limits<float>::quiet_NaN();
  seen(1, 1) = 298;
  cv::Mat1b mask(4, 4, std::uint8_t{255});
  mask(2, 2) = 0;
  const auto error = temperature_error(truth, seen, mask);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->pixels, 14u);
  EXPECT_NEAR(error->mae_k, 15.0 / 14, 1e-12);
  EXPECT_NEAR(error->bias_k, 11.0 / 14, 1e-12);
  mask = 0;
  EXPECT_FALSE(temperature_error(truth, seen, mask));
}

TEST(MetricsStress, RenderMetrics) {
  const cv::Mat image = noise(40, 40);
  const auto same = render_metrics(image, image);
  ASSERT_TRUE(same);
  EXPECT_NEAR(value(*same, "cosine"), 1, 1e-12);
  EXPECT_NEAR(value(*same, "hist"), 1, 1e-12);
  const cv::Mat black = cv::Mat::zeros(40, 40, CV_8UC1);
  EXPECT_EQ(value(*render_metrics(black, black), "cosine"), 1);
  EXPECT_EQ(value(*render_metrics(black, image), "cosine"), 0);
}

}  // namespace
}  // namespace orbitfuse
