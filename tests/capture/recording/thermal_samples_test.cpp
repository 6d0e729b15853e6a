// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/thermal_samples.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "capture/recording/frame_encoding.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

Frame frame_of(std::initializer_list<int> samples) {
  Frame frame;
  frame.pixels.create(1, static_cast<int>(samples.size()), CV_16UC1);
  int x = 0;
  for (const int sample : samples)
    frame.pixels.at<std::uint16_t>(0, x++) = static_cast<std::uint16_t>(sample);
  return frame;
}

double kelvin(const Frame& frame, int x) {
  return frame.pixels.at<std::uint16_t>(0, x) * frame.kelvin_per_count;
}

TEST(ThermalSamples, LinearOnesKeepTheCamerasScaleAndEveryCount) {
  ThermalSamples samples = ThermalSamples::linear(0.04);
  Frame frame = frame_of({0, 7500, 29329});
  EXPECT_FALSE(samples.apply(frame, 65535));
  EXPECT_EQ(frame.pixels.at<std::uint16_t>(0, 0), 0);
  EXPECT_NEAR(kelvin(frame, 1), 300, 1e-9);
  EXPECT_NEAR(kelvin(frame, 2), kelvin_from_celsius(900), 0.02);
  EXPECT_TRUE(frame.flags.empty());
  const auto encoded = encode_frame(frame, Modality::thermal, "f");
  ASSERT_TRUE(encoded);
  EXPECT_EQ(encoded->scale.scale, 0.04);
}

TEST(ThermalSamples, TheEndOfTheScaleIsNoTemperatureAndToldOnce) {
  ThermalSamples samples = ThermalSamples::linear(0.04);
  Frame first = frame_of({16383, 16382, 7500, 16384}), second = frame_of({16383});
  const auto words = samples.apply(first, 16383);
  ASSERT_TRUE(words);
  EXPECT_NE(words->find("2 samples"), std::string::npos) << *words;
  EXPECT_NE(words->find("382 C or hotter"), std::string::npos) << *words;
  EXPECT_EQ(kelvin(first, 0), 0);
  EXPECT_EQ(kelvin(first, 3), 0);
  EXPECT_NEAR(kelvin(first, 1), 655.28, 1e-9);
  EXPECT_EQ(first.flags, std::vector<std::string>{"clipped"});
  EXPECT_FALSE(samples.apply(second, 16383));
  EXPECT_EQ(second.flags, std::vector<std::string>{"clipped"});
}

TEST(ThermalSamples, OfATableEachFrameTakesTheFinestScaleThatHoldsIt) {
  std::vector<double> table(65536, std::nan(""));
  table[100] = 300;
  table[200] = kelvin_from_celsius(900);
  table[300] = kelvin_from_celsius(2000);
  table[400] = 9000;  // nothing holds it
  table[500] = std::numeric_limits<double>::infinity();
  table[600] = -5;
  ThermalSamples samples = ThermalSamples::table(table);
  Frame cool = frame_of({100, 0, 600}), hot = frame_of({100, 200}), hotter = frame_of({100, 300}),
        beyond = frame_of({100, 400, 500, 65535});
  EXPECT_FALSE(samples.apply(cool, 65535));
  EXPECT_EQ(cool.kelvin_per_count, 0.01);
  EXPECT_EQ(cool.pixels.at<std::uint16_t>(0, 0), 30000);
  EXPECT_EQ(cool.pixels.at<std::uint16_t>(0, 1), 0);
  EXPECT_EQ(cool.pixels.at<std::uint16_t>(0, 2), 0);
  EXPECT_FALSE(samples.apply(hot, 65535));
  EXPECT_EQ(hot.kelvin_per_count, 0.02);
  EXPECT_NEAR(kelvin(hot, 1), kelvin_from_celsius(900), 0.011);
  EXPECT_FALSE(samples.apply(hotter, 65535));
  EXPECT_EQ(hotter.kelvin_per_count, 0.04);
  const auto words = samples.apply(beyond, 65535);
  ASSERT_TRUE(words);
  EXPECT_NE(words->find("3 samples"), std::string::npos) << *words;
  EXPECT_NEAR(kelvin(beyond, 0), 300, 0.051);
  for (int x = 1; x < 4; ++x) EXPECT_EQ(kelvin(beyond, x), 0) << x;
}

}  // namespace
}  // namespace orbitfuse
