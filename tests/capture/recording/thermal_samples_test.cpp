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

TEST(ThermalSamples, OfATableTheScaleHoldsTheHottestSampleUpToNow) {
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
  EXPECT_EQ(beyond.kelvin_per_count, 0.04);  // what no scale holds decides nothing
  EXPECT_NEAR(kelvin(beyond, 0), 300, 0.021);
  for (int x = 1; x < 4; ++x) EXPECT_EQ(kelvin(beyond, x), 0) << x;
}

TEST(ThermalSamples, FramesThatCrossTheEndOfAScaleDoNotGoBack) {
  std::vector<double> table(65536);
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = 0.013 * static_cast<double>(i);
  const std::uint16_t at_limit = 50411, above = 50412;  // 655.343 K and 655.356 K: 65535.6 counts
  ThermalSamples samples = ThermalSamples::table(table);
  std::vector<double> scales;
  for (const std::uint16_t hottest : {at_limit, above, at_limit, above, std::uint16_t{20000}}) {
    Frame frame = frame_of({20000, hottest});
    EXPECT_FALSE(samples.apply(frame, 65535));
    scales.push_back(frame.kelvin_per_count);
    EXPECT_NEAR(kelvin(frame, 0), 260, frame.kelvin_per_count / 2 + 1e-9);
    EXPECT_NEAR(kelvin(frame, 1), table[hottest], frame.kelvin_per_count / 2 + 1e-9);
  }
  EXPECT_EQ(scales, (std::vector<double>{0.01, 0.02, 0.02, 0.02, 0.02}));
}

TEST(ThermalSamples, ASessionThatGoesOnKeepsItsScale) {
  ThermalSamples table = ThermalSamples::table(std::vector<double>(65536, 300.0));
  table.store_no_finer_than(0.04);
  table.store_no_finer_than(0.02);  // not back
  Frame cool = frame_of({100}), counted = frame_of({7500});
  EXPECT_FALSE(table.apply(cool, 65535));
  EXPECT_EQ(cool.kelvin_per_count, 0.04);
  EXPECT_NEAR(kelvin(cool, 0), 300, 1e-9);
  ThermalSamples linear = ThermalSamples::linear(0.04);
  linear.store_no_finer_than(0.1);
  EXPECT_FALSE(linear.apply(counted, 65535));
  EXPECT_EQ(counted.kelvin_per_count, 0.04);  // the camera's own counts
}

}  // namespace
}  // namespace orbitfuse
