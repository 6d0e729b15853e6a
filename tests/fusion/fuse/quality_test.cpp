// SPDX-License-Identifier: BSD-3-Clause
// The bars of docs/benchmarks/fusion.md on all reference pairs, means over the pairs.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "fusion/fuse/fuse.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/support/shared_data.hpp"

namespace orbitfuse {
namespace {

using Scores = std::map<std::string, double>;

class FusionQuality : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::shared_data() / "fusion";
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << "no shared data at " << folder_;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "pairs")) {
      const std::string file = entry.path().filename().string();
      if (file.ends_with("_ir.png")) names_.push_back(file.substr(0, file.size() - 7));
    }
    ASSERT_FALSE(names_.empty());
  }

  Scores reference(const std::string& wanted) const {
    std::ifstream file(folder_ / "reference" / "metrics.csv");
    Scores sums;
    for (std::string line; std::getline(file, line);) {
      std::istringstream fields(line);
      std::string pair, method, metric, value;
      for (std::string* field : {&pair, &method, &metric, &value})
        std::getline(fields, *field, ',');
      // VIFB's SSIM is the sum over the sources; ours is the mean.
      if (method == wanted)
        sums[metric == "SSIM_mean" ? "SSIM"
             : metric == "SSIM"    ? "SSIM_sum"
                                   : metric] += std::stod(value);
    }
    for (auto& [metric, sum] : sums) sum /= static_cast<double>(names_.size());
    return sums;
  }

  Scores ours(const std::string& method) const {
    FusionOptions options;
    options.method = fusion_method(method).value();
    Scores sums;
    for (const std::string& name : names_) {
      const cv::Mat v = cv::imread(folder_ / "pairs" / (name + "_vis.png"), cv::IMREAD_GRAYSCALE),
                    t = cv::imread(folder_ / "pairs" / (name + "_ir.png"), cv::IMREAD_GRAYSCALE);
      const auto values = fusion_metrics(v, t, fuse(v, t, {}, options).value()).value();
      for (const MetricValue& m : values)
        sums[m.name] += m.value / static_cast<double>(names_.size());
    }
    return sums;
  }

 private:
  std::filesystem::path folder_;
  std::vector<std::string> names_;
};

TEST_F(FusionQuality, MethodsReachTheirReferences) {
  for (const auto& [method, name] :
       {std::pair{"ms-srif", "LP_SR"}, {"pca-msif", "FPDE"}, {"cnn-lpif", "CNN"}}) {
    Scores mine = ours(method), theirs = reference(name);
    for (const char* metric : {"Qabf", "Qcb", "SSIM"})
      EXPECT_GE(mine[metric], theirs[metric]) << method << " " << metric;
    EXPECT_LE(mine["Qcv"], 1.02 * theirs["Qcv"]) << method;
  }
}

TEST_F(FusionQuality, BestBeatsAllReferences) {
  Scores mine = ours("best");
  for (const char* name : {"LP_SR", "FPDE", "CNN"}) {
    Scores theirs = reference(name);
    EXPECT_GT(mine["Qabf"], theirs["Qabf"]) << name;
    EXPECT_GT(mine["Qcb"], theirs["Qcb"]) << name;
    EXPECT_LT(mine["Qcv"], theirs["Qcv"]) << name;
  }
}

}  // namespace
}  // namespace orbitfuse
