// SPDX-License-Identifier: BSD-3-Clause
// Large images: indices must not overflow, and the answer is the small image's wherever it sees no
// more.
#include <gtest/gtest.h>

#include <cmath>

#include "fusion/fuse/fuse.hpp"
#include "fusion/metrics/metrics.hpp"
#include "tests/fusion/fuse/images.hpp"

namespace orbitfuse {
namespace {
using namespace testing;

const cv::Size large(4096, 3072);

TEST(FusionLarge, EveryMethod) {
  const cv::Mat1b v = noise(large, 1), t = ramp(large);
  const cv::Rect middle(1024, 1024, 512, 512), inner(192, 192, 128, 128);
  for (const std::string& method : fusion_method_names()) {
    FusionOptions options;
    options.method = fusion_method(method).value();
    const auto fused = fuse(v, t, {}, options);
    ASSERT_TRUE(fused) << method;
    ASSERT_EQ(fused->size(), large);
    // Heat and PCA-MSIF weigh by the whole image; CNN-LPIF's pyramid goes down to one pixel.
    if (method == "heat" || method == "pca-msif" || method == "cnn-lpif") continue;
    const cv::Mat part = fuse(v(middle), t(middle), {}, options).value();
    EXPECT_LE(cv::norm((*fused)(middle)(inner), part(inner), cv::NORM_INF), 1) << method;
  }
}

TEST(FusionLarge, Metrics) {
  const auto values = fusion_metrics(noise(large, 1), ramp(large), noise(large, 2));
  ASSERT_TRUE(values);
  for (const MetricValue& m : *values) EXPECT_TRUE(std::isfinite(m.value)) << m.name;
}

TEST(FusionLarge, WideAndTall) {
  for (const cv::Size size : {cv::Size(16, 4096), cv::Size(4096, 16), cv::Size(4095, 17)})
    for (const std::string& method : fusion_method_names()) {
      FusionOptions options;
      options.method = fusion_method(method).value();
      const auto fused = fuse(noise(size, 1), noise(size, 2), {}, options);
      ASSERT_TRUE(fused) << method;
      EXPECT_EQ(fused->size(), size);
    }
}

}  // namespace
}  // namespace orbitfuse
