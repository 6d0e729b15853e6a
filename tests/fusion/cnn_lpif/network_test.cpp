// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/network.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <random>

#include "fusion/cnn_lpif/cnn_lpif.hpp"
#include "fusion/cnn_lpif/score_map.hpp"
#include "fusion/training/dead_leaves.hpp"

namespace orbitfuse::fusion {
namespace {

TEST(Network, GradientsMatchFiniteDifferences) {
  std::mt19937 random(1);
  std::vector<double> p(cnn::Layout::size), in(cnn::patch * cnn::patch);
  for (double& v : p) v = uniform(random, -0.5, 0.5);
  for (double& v : in) v = uniform(random, 0, 1);
  cnn::Activations<double> a;
  cnn::score(p.data(), in.data(), a);
  std::vector<double> gradient(p.size());
  cnn::backward(p.data(), in.data(), a, 1.0, gradient.data());
  constexpr double h = 1e-6;
  double largest = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double kept = p[i];
    p[i] = kept + h;
    const double up = cnn::score(p.data(), in.data(), a);
    p[i] = kept - h;
    const double down = cnn::score(p.data(), in.data(), a);
    p[i] = kept;
    EXPECT_NEAR(gradient[i], (up - down) / (2 * h), 1e-6 * std::max(1.0, std::abs(gradient[i])))
        << i;
    largest = std::max(largest, std::abs(gradient[i]));
  }
  EXPECT_GT(largest, 0.1);
}

TEST(ScoreMap, IsTheNetworkOnEveryPatch) {
  const Plane image = dead_leaves({61, 45}, 3);
  const auto& p = cnn::shipped_network();
  const Plane map = cnn::score_map(image, p);
  EXPECT_EQ(map.size(), cv::Size((61 - 16) / 2 + 1, (45 - 16) / 2 + 1));
  for (int y = 0; y < map.rows; y += 3)
    for (int x = 0; x < map.cols; x += 5) {
      std::array<float, cnn::patch * cnn::patch> in;
      for (int i = 0; i < cnn::patch * cnn::patch; ++i)
        in[static_cast<std::size_t>(i)] =
            image(2 * y + i / cnn::patch, 2 * x + i % cnn::patch) / 255;
      cnn::Activations<float> a;
      const float expected = cnn::score(p.data(), in.data(), a);
      EXPECT_NEAR(map(y, x), expected, 1e-3F * std::max(1.0F, std::abs(expected)));
    }
}

TEST(ScoreMap, InstructionSetsAgreeToTheBit) {
  if (best_isa() < Isa::avx512) GTEST_SKIP() << "this processor has no AVX-512";
  for (const cv::Size size :
       {cv::Size(16, 16), cv::Size(17, 31), cv::Size(130, 49), cv::Size(301, 77)}) {
    const Plane image = dead_leaves(size, 4);
    const auto& p = cnn::shipped_network();
    EXPECT_EQ(cv::norm(cnn::score_map(image, p, {}, Isa::avx2),
                       cnn::score_map(image, p, {}, Isa::avx512), cv::NORM_INF),
              0);
  }
}

TEST(ScoreMap, SkippedTilesDoNotChangeTheOthers) {
  const Plane image = dead_leaves({200, 120}, 8);
  const auto& p = cnn::shipped_network();
  const Plane all = cnn::score_map(image, p);
  cv::Mat1b needed = cv::Mat1b::zeros(all.size());
  const cv::Rect part(31, 10, 22, 17);
  needed(part) = 255;
  const Plane some = cnn::score_map(image, p, needed);
  EXPECT_EQ(cv::norm(all(part), some(part), cv::NORM_INF), 0);
  EXPECT_EQ(some(50, 5), 0) << "what nobody needs is not computed";
  EXPECT_EQ(some(12, 80), 0);
}

TEST(Network, PrefersTheSharpSideOfUnseenImages) {
  int right = 0, all = 0;
  for (const unsigned seed : {901U, 902U, 903U}) {
    const Plane sharp = dead_leaves({128, 128}, seed);
    Plane soft;
    cv::GaussianBlur(sharp, soft, {}, 2);
    const Plane a = cnn::score_map(sharp, cnn::shipped_network()),
                b = cnn::score_map(soft, cnn::shipped_network());
    right += cv::countNonZero(a > b);
    all += static_cast<int>(a.total());
  }
  EXPECT_GT(right, 0.95 * all);
}

TEST(Network, ExchangingTheImagesExchangesTheWeights) {
  const Plane a = dead_leaves({64, 64}, 5), b = dead_leaves({64, 64}, 6);
  CnnLpifReport report;
  const Plane w = thermal_weight(a, b, {}, report), swapped = thermal_weight(b, a, {}, report);
  EXPECT_LT(cv::norm(w + swapped, Plane(w.size(), 1.0F), cv::NORM_INF), 1e-5);
}

TEST(Network, EqualPatchesAreNotAsked) {
  const Plane a = dead_leaves({96, 96}, 7);
  Plane b = a.clone();
  b(10, 10) += 100;
  CnnLpifReport report;
  const Plane w = thermal_weight(a, b, {}, report);
  EXPECT_GT(report.patches_skipped, 0.9);
  EXPECT_LT(report.patches_skipped, 1.0);
  EXPECT_FLOAT_EQ(w(80, 80), 0.5F);
}

TEST(Network, HalvedImagesGiveACoarserWeightOfFullSize) {
  const Plane a = dead_leaves({200, 120}, 5), b = dead_leaves({200, 120}, 6);
  CnnLpifOptions options;
  CnnLpifReport report;
  const Plane full = thermal_weight(a, b, options, report);
  for (const int halvings : {1, 2, 8}) {  // 8: stops at one patch
    options.network_halvings = halvings;
    const Plane w = thermal_weight(a, b, options, report);
    ASSERT_EQ(w.size(), a.size());
    EXPECT_GT(cv::norm(w, full, cv::NORM_INF), 0) << halvings;
    double low = 0, high = 0;
    cv::minMaxLoc(w, &low, &high);
    EXPECT_GE(low, -1e-6) << "running sums round";
    EXPECT_LE(high, 1 + 1e-6);
  }
}

TEST(Network, DamagedBytesAreErrors) {
  EXPECT_FALSE(cnn::parameters_of_bytes("abc"));
  std::string bytes = cnn::bytes_of(cnn::shipped_network());
  for (std::size_t i = 0; i < 4; ++i) bytes[i] = static_cast<char>(0xff);  // NaN
  EXPECT_FALSE(cnn::parameters_of_bytes(bytes));
}

}  // namespace
}  // namespace orbitfuse::fusion
