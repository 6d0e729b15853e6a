// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/frame_rhythm.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace orbitfuse {
namespace {

constexpr std::int64_t ms = 1'000'000;

FrameRhythm settled_at_10_hz(std::uint64_t frames) {
  FrameRhythm rhythm;
  for (std::uint64_t id = 0; id < frames; ++id) {
    EXPECT_EQ(rhythm.note(id, 1000 * ms + 100 * ms * static_cast<std::int64_t>(id)), 0);
  }
  return rhythm;
}

TEST(FrameRhythm, FramesMissingWithoutAHoleAreNoticed) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  EXPECT_EQ(rhythm.note(20, 1000 * ms + 2300 * ms), 3);  // 2.0 s was due
}

TEST(FrameRhythm, AHoleInTheIdsExplainsTheTime) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  EXPECT_EQ(rhythm.note(23, 1000 * ms + 2300 * ms), 0);
}

TEST(FrameRhythm, JitterAndTheStartOfAStreamAreNotLate) {
  FrameRhythm rhythm;
  std::int64_t stamp = 500 * ms;
  EXPECT_EQ(rhythm.note(0, stamp), 0);
  EXPECT_EQ(rhythm.note(1, stamp += 400 * ms), 0);  // nothing is known yet
  for (std::uint64_t id = 2; id < 40; ++id) stamp += 100 * ms, rhythm.note(id, stamp);
  for (std::uint64_t id = 40; id < 60; ++id) {
    EXPECT_EQ(rhythm.note(id, stamp += (id % 2 == 0 ? 140 : 60) * ms), 0) << id;
  }
}

TEST(FrameRhythm, ASlowerRateIsFollowed) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  std::int64_t stamp = 1000 * ms + 1900 * ms;
  int told = 0;
  for (std::uint64_t id = 20; id < 60; ++id) told += rhythm.note(id, stamp += 200 * ms) > 0;
  EXPECT_GT(told, 0);
  EXPECT_LT(told, 5);
}

TEST(FrameRhythm, OutagesAreCountedInFramesAndNotAsLate) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  EXPECT_EQ(rhythm.frames_in(3.0), 30u);
  rhythm.interrupt();
  EXPECT_EQ(rhythm.note(50, 1000 * ms + 60'000 * ms), 0);
  EXPECT_EQ(FrameRhythm().frames_in(3.0), 1u);
}

TEST(FrameRhythm, APauseChangesNothingOfWhatWasLearnt) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  std::int64_t stamp = 1000 * ms + 1900 * ms;
  EXPECT_EQ(rhythm.note(20, stamp += 60'100 * ms),
            600);  // a minute without a frame, no hole in the ids
  const auto in_ten_s = static_cast<double>(rhythm.frames_in(10));
  EXPECT_NEAR(in_ten_s, 100, 10);
  for (std::uint64_t id = 21; id < 40; ++id) EXPECT_EQ(rhythm.note(id, stamp += 100 * ms), 0) << id;
  EXPECT_EQ(rhythm.note(40, stamp += 300 * ms), 2);
  rhythm.interrupt();
  EXPECT_EQ(rhythm.note(900, stamp += 3'600'000 * ms), 0);
  for (std::uint64_t id = 901; id < 920; ++id)
    EXPECT_EQ(rhythm.note(id, stamp += 100 * ms), 0) << id;
  EXPECT_NEAR(static_cast<double>(rhythm.frames_in(10)), 100, 5);
}

TEST(FrameRhythm, ABusyMomentDoesNotHideTheRateThatTheStreamHeld) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  std::int64_t stamp = 1000 * ms + 1900 * ms;
  for (std::uint64_t id = 20; id < 60; ++id) rhythm.note(id, stamp += 160 * ms);
  EXPECT_NEAR(static_cast<double>(rhythm.frames_in(16)), 100, 2);
  EXPECT_EQ(rhythm.most_frames_in(16), 160u);
  EXPECT_EQ(FrameRhythm().most_frames_in(16), 1u);
}

TEST(FrameRhythm, ABurstOfKeptFramesIsNoRate) {
  FrameRhythm rhythm = settled_at_10_hz(40);
  std::int64_t stamp = 8000 * ms;
  for (std::uint64_t id = 40; id < 100; ++id) rhythm.note(id, stamp += 100'000);
  EXPECT_LE(rhythm.frames_in(13), 4000u) << "130 at the camera's rate, 130,000 at the burst's";
  EXPECT_LE(rhythm.most_frames_in(13), 4000u);
}

TEST(FrameRhythm, StampsThatAreNoTimeSayNothing) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  for (const std::int64_t stamp : {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1},
                                   std::numeric_limits<std::int64_t>::max()})
    EXPECT_EQ(rhythm.note(20, stamp), 0);
  EXPECT_EQ(rhythm.frames_in(1), 10u);
}

TEST(FrameRhythm, StampsThatDoNotRiseSayNothing) {
  FrameRhythm rhythm = settled_at_10_hz(20);
  EXPECT_EQ(rhythm.note(20, 1), 0);
  EXPECT_EQ(rhythm.note(21, 1), 0);
  EXPECT_EQ(rhythm.note(22, 0), 0);
  EXPECT_EQ(rhythm.frames_in(1.0), 10u);
}

}  // namespace
}  // namespace orbitfuse
