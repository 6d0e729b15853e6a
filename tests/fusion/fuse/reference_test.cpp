// SPDX-License-Identifier: BSD-3-Clause
// Quality on real pairs must not fall below what docs/benchmarks/fusion.md reports. One pair only,
// for time; the bench has all twelve.
#include <gtest/gtest.h>

#include <map>
#include <opencv2/imgcodecs.hpp>

#include "fusion/fuse/fuse.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/support/shared_data.hpp"

namespace orbitfuse {
namespace {

std::map<std::string, double> scores(const cv::Mat& v, const cv::Mat& t, const cv::Mat& fused) {
  std::map<std::string, double> result;
  const auto values = fusion_metrics(v, t, fused).value();
  for (const MetricValue& m : values) result[m.name] = m.value;
  return result;
}

TEST(FusionReference, NotBelowTheReferenceImages) {
  const auto folder = testing::shared_data() / "fusion";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared data at " << folder;
  const std::string pair = "VIFB_carLight";
  const cv::Mat v = cv::imread(folder / "pairs" / (pair + "_vis.png"), cv::IMREAD_GRAYSCALE);
  const cv::Mat t = cv::imread(folder / "pairs" / (pair + "_ir.png"), cv::IMREAD_GRAYSCALE);
  for (const auto& [method, reference] : std::map<std::string, std::string>{
           {"ms-srif", "LP_SR"}, {"pca-msif", "FPDE"}, {"cnn-lpif", "CNN"}, {"best", "LP_SR"}}) {
    FusionOptions options;
    options.method = fusion_method(method).value();
    const auto fused = fuse(v, t, {}, options);
    ASSERT_TRUE(fused);
    const auto file = folder / "reference" / reference / (pair + ".png");
    ASSERT_TRUE(std::filesystem::exists(file)) << file;
    auto ours = scores(v, t, *fused), theirs = scores(v, t, cv::imread(file, cv::IMREAD_GRAYSCALE));
    EXPECT_GT(ours["Qabf"], 0.97 * theirs["Qabf"]) << method;
    EXPECT_GT(ours["SSIM"], 0.97 * theirs["SSIM"]) << method;
  }
}

}  // namespace
}  // namespace orbitfuse
