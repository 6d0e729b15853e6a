// SPDX-License-Identifier: BSD-3-Clause
#include "capture/clock/clock_map.hpp"

#include <gtest/gtest.h>

#include <limits>

#include <cmath>
#include <random>

namespace orbitfuse {
namespace {

constexpr std::int64_t second = 1'000'000'000;

/// A 30 Hz camera whose clock is off, drifts and has 1 ms granularity; frames arrive 2 to 22 ms
/// late, one in fifty 80 ms late.
struct Camera30Hz {
  double offset_s = 40, drift_ppm = 50;
  std::mt19937 random{7};

  std::int64_t true_ns(int frame) const { return 1'700'000'000 * second + frame * second / 30; }
  std::int64_t device_ns(int frame) const {
    const double t = frame / 30.0;
    const auto exact =
        true_ns(frame) + static_cast<std::int64_t>((offset_s + drift_ppm * 1e-6 * t) * 1e9);
    return exact / 1'000'000 * 1'000'000;
  }
  std::int64_t arrival_ns(int frame) {
    std::uniform_real_distribution<double> delay(0.002, 0.022);
    return true_ns(frame) +
           static_cast<std::int64_t>(((random() % 50 ? 0 : 0.08) + delay(random)) * 1e9);
  }
};

TEST(ClockMap, OffsetAndDriftWithinFiveMilliseconds) {
  Camera30Hz camera;
  ClockMap map;
  std::int64_t last = 0;
  for (int i = 0; i < 30 * 300; ++i) {
    const auto stamp = map.add(camera.device_ns(i), camera.arrival_ns(i));
    EXPECT_GT(stamp.host_time_ns, last);
    EXPECT_FALSE(stamp.event);
    last = stamp.host_time_ns;
    if (i > 30 * 10) {
      EXPECT_NEAR(static_cast<double>(stamp.host_time_ns - camera.true_ns(i)) * 1e-9, 0.002, 0.005);
    }
  }
  EXPECT_NEAR(map.drift_ppm(), -50, 15);  // host gains what the device loses
  EXPECT_NEAR(map.offset_s(), -40, 0.1);
  EXPECT_LE(map.residual_rms_s(), 0.005);
  EXPECT_GT(map.residual_rms_s(), 0);
  EXPECT_EQ(map.jumps(), 0);
}

TEST(ClockMap, StampsThatAreNoTimeCountAsNone) {
  ClockMap clock;
  std::int64_t arrival = 1'800'000'000'000'000'000, last = 0;
  for (const std::int64_t stamp :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}, std::int64_t{5},
        std::numeric_limits<std::int64_t>::max(), std::int64_t{1} << 62, std::int64_t{7}}) {
    const std::int64_t taken = clock.add(stamp, arrival += 1'000'000).host_time_ns;
    EXPECT_GT(taken, last);
    EXPECT_LE(taken, arrival);
    last = taken;
  }
}

TEST(ClockMap, StepsAreToldOnceAndTimeNeverGoesBack) {
  for (double step_s : {-3.2, 5.0}) {
    Camera30Hz camera;
    ClockMap map;
    std::int64_t last = 0;
    int events = 0;
    for (int i = 0; i < 30 * 60; ++i) {
      if (i == 30 * 20) camera.offset_s += step_s;
      const auto stamp = map.add(camera.device_ns(i), camera.arrival_ns(i));
      EXPECT_GT(stamp.host_time_ns, last);
      last = stamp.host_time_ns;
      if (stamp.event) {
        ++events;
        EXPECT_NEAR(std::stod(stamp.event->substr(16)), step_s, 0.15) << *stamp.event;
      }
      EXPECT_NEAR(static_cast<double>(last - camera.true_ns(i)) * 1e-9, 0.01, 0.12);
    }
    EXPECT_EQ(events, 1);
    EXPECT_EQ(map.jumps(), 1);
  }
}

TEST(ClockMap, NoDeviceClockFallsBackOnArrival) {
  ClockMap map;
  EXPECT_EQ(map.add(0, 100).host_time_ns, 100);
  EXPECT_EQ(map.add(0, 100).host_time_ns, 101);  // still strictly rising
  EXPECT_EQ(map.add(0, 50).host_time_ns, 102);
}

TEST(ClockMap, OneLateFrameIsNoJump) {
  ClockMap map;
  for (int i = 1; i < 100; ++i) {
    const std::int64_t t = i * second / 10;
    const auto stamp = map.add(t, t + 5 * second + (i == 50 ? second / 2 : 0));
    EXPECT_FALSE(stamp.event) << i;
  }
  EXPECT_EQ(map.jumps(), 0);
}

TEST(GvspFrameCounter, WrapsFrom65535To1) {
  GvspFrameCounter counter;
  EXPECT_EQ(counter.unwrap(65534), 0u);
  EXPECT_EQ(counter.unwrap(65535), 1u);
  EXPECT_EQ(counter.unwrap(1), 2u);
  EXPECT_EQ(counter.unwrap(4), 5u);            // two lost
  EXPECT_EQ(counter.unwrap(3), std::nullopt);  // late
  EXPECT_EQ(counter.unwrap(4), std::nullopt);  // twice
  EXPECT_EQ(counter.unwrap(0), std::nullopt);  // never sent
  counter.restart();
  EXPECT_EQ(counter.unwrap(65400), 6u);
}

TEST(GvspFrameCounter, CountsExactlyOverManyWraps) {
  GvspFrameCounter counter;
  std::uint64_t truth = 0, counted = 0;
  std::mt19937 random(3);
  ASSERT_EQ(counter.unwrap(65400), 0u);
  for (int i = 0; i < 20000; ++i) {
    truth += 1 + (random() % 40 == 0 ? random() % 300 : 0);
    counted = *counter.unwrap(static_cast<std::uint16_t>((65400 - 1 + truth) % 65535 + 1));
    ASSERT_EQ(counted, truth);
  }
  EXPECT_GT(truth, 65535u);
}

}  // namespace
}  // namespace orbitfuse
