// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/estimate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse::measurement {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
const MeasurementOptions options;

Estimate estimated(const std::vector<WeightedReading>& readings, const FieldReading& field) {
  return estimate(readings, agreement_of(readings, options), field, options);
}

std::vector<WeightedReading> camps(int cold, int hot) {
  std::vector<WeightedReading> readings(static_cast<std::size_t>(cold), {300, 0, 1});
  readings.insert(readings.end(), static_cast<std::size_t>(hot), {310, 0, 1});
  return readings;
}

TEST(MeasurementEstimate, IsTheWeightedMeanWithoutOutliers) {
  std::vector<WeightedReading> readings{{300.0, 0, 1}, {300.2, 0, 1}, {300.1, 0, 2}};
  const Estimate plain = estimated(readings, {nan});
  EXPECT_NEAR(plain.temperature_k, 300.1, 1e-9);
  readings.push_back({350, 0, 0.5});
  EXPECT_NEAR(estimated(readings, {nan}).temperature_k, 300.1, 1e-9);
}

TEST(MeasurementEstimate, UncertaintyGrowsWithWhatItIsMadeOf) {
  const std::vector<WeightedReading> calm{{300, 0}, {300, 0}, {300, 0}};
  std::vector<WeightedReading> scattered = calm, steep = calm;
  scattered[0].temperature_k = 299, scattered[2].temperature_k = 301;
  for (WeightedReading& r : steep) r.gradient_k_per_px = 2;
  const double least = estimated(calm, {300}).uncertainty_k;
  EXPECT_GE(least, options.coverage_factor * options.common_sigma_k);
  EXPECT_GT(estimated(scattered, {300}).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimated(steep, {300}).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimated(calm, {302}).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimated(calm, {300, 1}).uncertainty_k, 1.2 * least);
  EXPECT_GT(estimated(calm, {300, 0, 2}).uncertainty_k, 1.5 * least);
  EXPECT_LE(estimated(calm, {nan}).uncertainty_k, least);
}

TEST(MeasurementEstimate, TwoFramesThatContradictAreBothTold) {
  const Agreement agreement = agreement_of(camps(1, 1), options);
  EXPECT_TRUE(agreement.two_camps);
  const Estimate e = estimated(camps(1, 1), {nan});
  EXPECT_NEAR(e.temperature_k, 305, 1e-9);
  EXPECT_GT(e.uncertainty_k, 5) << "either may be right";
}

TEST(MeasurementEstimate, ManyAgainstManyAreAllTold) {
  EXPECT_TRUE(agreement_of(camps(6, 4), options).two_camps);
  const Estimate e = estimated(camps(6, 4), {nan});
  EXPECT_NEAR(e.temperature_k, 304, 1e-9);
  EXPECT_GT(e.uncertainty_k, 6) << "either may be right";
  const Agreement few = agreement_of(camps(8, 2), options);
  EXPECT_FALSE(few.two_camps);
  EXPECT_FALSE(few.uses(9));
  EXPECT_NEAR(estimated(camps(8, 2), {nan}).temperature_k, 300, 1e-9);
}

TEST(MeasurementEstimate, WhatIsAssumedIsTold) {
  const Estimate e = estimated({{300, 0}, {300, 0}}, {300, 0, 2});
  EXPECT_NEAR(e.assumed_k, 2 * options.coverage_factor * options.common_sigma_k, 1e-12);
  EXPECT_GE(e.uncertainty_k, e.assumed_k);
}

TEST(MeasurementEstimate, FramesThatDifferAsSensorsDoAreNoCamps) {
  EXPECT_FALSE(agreement_of({{300.0, 0}, {300.4, 0}}, options).two_camps);
}

TEST(MeasurementEstimate, OneReadingHasNoSpread) {
  const Estimate one = estimated({{300, 0.1}}, {300});
  EXPECT_EQ(one.temperature_k, 300);
  EXPECT_TRUE(std::isnan(one.spread_k));
  EXPECT_TRUE(std::isfinite(one.uncertainty_k));
}

TEST(MeasurementEstimate, FarFromZeroNothingIsLost) {
  const Estimate hot = estimated({{3000.01, 0}, {3000.03, 0}}, {nan});
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
