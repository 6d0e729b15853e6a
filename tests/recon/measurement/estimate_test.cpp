// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse::measurement {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
const MeasurementOptions options;

TEST(MeasurementEstimate, IsTheWeightedMeanWithoutOutliers) {
  std::vector<WeightedReading> readings{{300.0, 0, 1}, {300.2, 0, 1}, {300.1, 0, 2}};
  const Estimate plain = estimate(readings, {nan}, options);
  EXPECT_NEAR(plain.temperature_k, 300.1, 1e-9);
  readings.push_back({350, 0, 0.5});
  EXPECT_NEAR(estimate(readings, {nan}, options).temperature_k, 300.1, 1e-9);
}

TEST(MeasurementEstimate, UncertaintyGrowsWithWhatItIsMadeOf) {
  const std::vector<WeightedReading> calm{{300, 0}, {300, 0}, {300, 0}};
  std::vector<WeightedReading> scattered = calm, steep = calm;
  scattered[0].temperature_k = 299, scattered[2].temperature_k = 301;
  for (WeightedReading& r : steep) r.gradient_k_per_px = 2;
  const double least = estimate(calm, {300}, options).uncertainty_k;
  EXPECT_GE(least, options.coverage_factor * options.common_sigma_k);
  EXPECT_GT(estimate(scattered, {300}, options).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimate(steep, {300}, options).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimate(calm, {302}, options).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimate(calm, {300, 1}, options).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimate(calm, {300, 0, 2}, options).uncertainty_k, 1.5 * least);
  EXPECT_LE(estimate(calm, {nan}, options).uncertainty_k, least);
}

TEST(MeasurementEstimate, OneReadingHasNoSpread) {
  const Estimate one = estimate({{300, 0.1}}, {300}, options);
  EXPECT_EQ(one.temperature_k, 300);
  EXPECT_TRUE(std::isnan(one.spread_k));
  EXPECT_TRUE(std::isfinite(one.uncertainty_k));
}

TEST(MeasurementEstimate, FarFromZeroNothingIsLost) {
  const Estimate hot = estimate({{3000.01, 0}, {3000.03, 0}}, {nan}, options);
  EXPECT_NEAR(hot.temperature_k, 3000.02, 1e-9);
  EXPECT_NEAR(hot.spread_k, 0.01 * std::sqrt(2.0), 1e-9);
}

TEST(WeightedMedian, HalfOfTheWeightLiesBelow) {
  EXPECT_EQ(weighted_median({{3, 1}, {1, 1}, {2, 1}}), 2);
  EXPECT_EQ(weighted_median({{1, 1}, {2, 1}, {3, 10}}), 3);
  EXPECT_EQ(weighted_median({{7, 0.001}}), 7);
}

}  // namespace
}  // namespace orbitfuse::measurement
