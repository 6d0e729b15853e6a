// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/missed_frames.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>

namespace orbitfuse::aravis {
namespace {

/// At 60 Hz, two seconds.
constexpr MissedByTime two_seconds{119, 119};

void expect_counted_on(std::uint16_t last, std::uint16_t number, const MissedByTime& by_time,
                       std::uint64_t frames) {
  const Missed missed = missed_between(last, number, by_time);
  EXPECT_TRUE(missed.by_number) << last << " " << number;
  EXPECT_EQ(missed.frames, frames) << last << " " << number;
}

void expect_began_anew(std::optional<std::uint16_t> last, std::uint16_t number,
                       const MissedByTime& by_time) {
  const Missed missed = missed_between(last, number, by_time);
  EXPECT_FALSE(missed.by_number) << last.value_or(0) << " " << number;
  EXPECT_EQ(missed.frames, by_time.usual) << last.value_or(0) << " " << number;
}

TEST(MissedFrames, ACountThatGoesOnTellsExactly) {
  expect_counted_on(1000, 1119, two_seconds, 118);
  expect_counted_on(1000, 1001, two_seconds, 0);   // a pause: nothing was sent
  expect_counted_on(1000, 1080, two_seconds, 79);  // not sent while the stream was set up
  expect_counted_on(65500, 84, two_seconds, 118);  // 65535 is followed by 1
  expect_counted_on(65425, 9, two_seconds, 118);   // also where a new count could begin
}

TEST(MissedFrames, ANewCountIsTimed) {
  expect_began_anew(1000, 1, two_seconds);
  expect_began_anew(1000, 40000, two_seconds);
  expect_began_anew(65530, 3, two_seconds);  // it seems to follow, but 7 frames are no two seconds
}

TEST(MissedFrames, ABusyMomentBeforeTheOutageDoesNotSpoilTheCount) {
  // The last frames came at 60/1.6 Hz, those before at 60.
  constexpr MissedByTime slow{74, 119};
  expect_counted_on(1000, 1119, slow, 118);
  expect_counted_on(65425, 9, slow, 118);
  expect_began_anew(1000, 5, slow);
}

TEST(MissedFrames, ABurstIsNoRate) {
  constexpr MissedByTime burst{119, 100'000};
  expect_counted_on(1000, 1119, burst, 118);
  expect_began_anew(1000, 40000, burst);
}

TEST(MissedFrames, WithoutNumbersTheTimeTells) {
  expect_began_anew(std::nullopt, 100, two_seconds);
  expect_began_anew(100, 0, two_seconds);
  expect_began_anew(100, 100, two_seconds);
  expect_began_anew(100, 200, {40'000, 40'000});  // half a round: the same number may be the next's
}

}  // namespace
}  // namespace orbitfuse::aravis
