// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/freeze_watch.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace orbitfuse {
namespace {

using namespace std::chrono_literals;

/// A camera that sends at `rate_hz`; each picture of its sensor is a number.
class FreezeWatchTest : public ::testing::Test {
 protected:
  bool send(int picture, double rate_hz) {
    now += std::chrono::duration_cast<FreezeWatch::Clock::duration>(
        std::chrono::duration<double>(1 / rate_hz));
    Frame frame;
    begins += watch.mark(frame, &picture, sizeof picture, now);
    return !frame.flags.empty();
  }
  FreezeWatch watch{500ms};
  FreezeWatch::Clock::time_point now{10s};
  int begins = 0, next = 1;
};

TEST_F(FreezeWatchTest, AClosedShutterIsFlaggedUntilItHasSettled) {
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(send(next++, 30));
  const int shut = next++;
  EXPECT_FALSE(send(shut, 30));  // the last live picture
  for (int i = 0; i < 12; ++i) EXPECT_TRUE(send(shut, 30));
  EXPECT_EQ(begins, 1);
  int drifting = 0;
  while (send(next++, 30)) ++drifting;
  EXPECT_NEAR(drifting, 14, 1);  // 0.5 s
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(send(next++, 30));
  EXPECT_EQ(begins, 1);
  EXPECT_FALSE(send(7, 30));
  EXPECT_TRUE(send(7, 30));  // the next one is told anew
  EXPECT_EQ(begins, 2);
}

TEST_F(FreezeWatchTest, ASlowSensorsRepeatsAreNoFreezeButItsShutterIs) {
  int flagged = 0;
  for (int i = 0; i < 600; ++i) flagged += send(1000 + i * 9 / 60, 60);  // 6 or 7 of each
  EXPECT_LE(flagged, 60);  // until the repeats are known
  flagged = 0;
  for (int i = 600; i < 1200; ++i) flagged += send(1000 + i * 9 / 60, 60);
  EXPECT_EQ(flagged, 0);
  const int before = begins;
  for (int i = 0; i < 30; ++i) flagged += send(5, 60);
  EXPECT_EQ(begins, before + 1);
  EXPECT_GE(flagged, 20);
  flagged = 0;
  for (int i = 0; i < 60; ++i) send(2000 + i * 9 / 60, 60);
  for (int i = 60; i < 600; ++i) flagged += send(2000 + i * 9 / 60, 60);
  EXPECT_EQ(flagged, 0) << "a freeze taught it nothing";
}

TEST_F(FreezeWatchTest, ACorrectionThatWasAskedForIsFlaggedBeforeTheShutterCloses) {
  for (int i = 0; i < 10; ++i) send(next++, 30);
  watch.expect(now);
  for (int i = 0; i < 14; ++i) EXPECT_TRUE(send(next++, 30));
  for (int i = 0; i < 14; ++i) send(next++, 30);
  EXPECT_FALSE(send(next++, 30));
  EXPECT_EQ(begins, 0);
}

}  // namespace
}  // namespace orbitfuse
