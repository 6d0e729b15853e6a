// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/reradiometry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

namespace orbitfuse::measurement {
namespace {
using testing::HasSubstr;

FlirCalibration camera() {
  FlirCalibration c;
  c.planck = {.r1 = 16000, .r2 = 0.015, .b = 1430, .f = 1, .o = -6000};
  c.object = {.emissivity = 0.95, .distance_m = 2};
  return c;
}

ThermalFrame frame(std::optional<FlirCalibration> radiometry) {
  return {{"thermal/000.tiff", {}, {}}, {}, radiometry};
}

/// Other object parameters: emissivity, reflected temperature, distance.
ObjectParameterOverrides told(std::optional<double> emissivity,
                              std::optional<double> reflected_k = {},
                              std::optional<double> distance_m = {}) {
  ObjectParameterOverrides o;
  o.emissivity = emissivity;
  o.reflected_temperature_k = reflected_k;
  o.distance_m = distance_m;
  return o;
}

TEST(Reradiometry, OtherParametersGiveWhatTheSensorsSignalGives) {
  const FlirCalibration from = camera();
  FlirCalibration to = from;
  to.object.emissivity = 0.6, to.object.reflected_k = 283.15, to.object.distance_m = 20,
  to.object.atmospheric_k = 303.15, to.object.relative_humidity = 0.9;
  const auto change = Reradiometry::make({frame(from)}, {0.6, 20.0, 283.15, 303.15, 0.9}, {});
  ASSERT_TRUE(change) << change.error().message();
  int finite = 0;
  for (double signal = 9000; signal < 30000; signal += 1000) {
    const double stored = FlirThermometer(from).kelvin(signal);
    const double expected = FlirThermometer(to).kelvin(signal);
    ASSERT_TRUE(std::isfinite(stored));
    if (std::isnan(expected)) {  // colder than its reflection alone
      EXPECT_TRUE(std::isnan(change->frame_k(0, stored)));
      continue;
    }
    ++finite;
    EXPECT_NEAR(change->frame_k(0, stored), expected, 1e-6);
    EXPECT_NEAR(change->field_k(stored), expected, 1e-6);
  }
  EXPECT_GT(finite, 10);
  EXPECT_TRUE(change->assumption().empty());
}

TEST(Reradiometry, NothingSaidChangesNothing) {
  const auto same = Reradiometry::make({frame(std::nullopt)}, {}, {});
  ASSERT_TRUE(same);
  EXPECT_FALSE(same->changes());
  EXPECT_EQ(same->frame_k(0, 300.25), 300.25);
  EXPECT_EQ(same->field_k(300.25), 300.25);
}

TEST(Reradiometry, FramesWithoutRadiometryNeedTheUsersWord) {
  const auto refused = Reradiometry::make({frame(std::nullopt)}, told(0.5), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
  EXPECT_THAT(refused.error().message(), HasSubstr("thermal/000.tiff"));
  const auto word = Reradiometry::make({frame(std::nullopt)}, told(0.5), told(1.0, 293.15));
  ASSERT_TRUE(word) << word.error().message();
  EXPECT_THAT(word->assumption(), HasSubstr("emissivity 1"));
  // A grey body: S(350) = 0.5 S(T) + 0.5 S(293.15), by hand.
  const auto planck = [](double k) { return 1 / (std::exp(1438.8 / k) - 1); };
  const double s = (planck(350) - 0.5 * planck(293.15)) / 0.5;
  EXPECT_NEAR(word->frame_k(0, 350), 1438.8 / std::log(1 / s + 1), 1e-6);
  EXPECT_NEAR(word->frame_k(0, 293.15), 293.15, 1e-6) << "nothing to reflect but itself";
}

TEST(Reradiometry, AFieldOfFramesThatWereConvertedUnlikeIsNotKnown) {
  FlirCalibration other = camera();
  other.object.emissivity = 0.8;
  const auto change = Reradiometry::make({frame(camera()), frame(other)}, told(0.5), {});
  ASSERT_TRUE(change);
  EXPECT_TRUE(std::isnan(change->field_k(300)));
  EXPECT_NE(change->frame_k(0, 300), change->frame_k(1, 300));
}

TEST(Reradiometry, ImpossibleParametersAreUsageErrors) {
  for (const ObjectParameterOverrides& wrong :
       {told(0.0), told(std::nan("")), told({}, {}, -1.0), told({}, {}, 1e5), told({}, -3.0)}) {
    const auto refused = Reradiometry::make({frame(camera())}, wrong, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::usage);
  }
  // A signal colder than anything under much reflection: no temperature, and no number.
  const auto change = Reradiometry::make({frame(camera())}, told(0.01, 500.0), {});
  ASSERT_TRUE(change);
  EXPECT_TRUE(std::isnan(change->frame_k(0, 250)));
}

}  // namespace
}  // namespace orbitfuse::measurement
