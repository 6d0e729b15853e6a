// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/tracking_views.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

/// Two loops of twelve, found 3 deg beyond nominal at odd stations, world offset 40 deg.
std::vector<PassedStation> passed(std::uint64_t stride, bool clockwise = false) {
  std::vector<PassedStation> list;
  for (int i = 0; i < 24; ++i) {
    PassedStation p;
    p.sequence = static_cast<std::uint64_t>(i) * stride;
    p.station.loop = i / 12, p.station.index = i % 12, p.station.azimuth_deg = 30.0 * (i % 12);
    const double walked = p.station.azimuth_deg + (i % 2 == 1 ? 3 : 0);
    p.azimuth_deg = 40 + (clockwise ? -walked : walked);
    list.push_back(p);
  }
  return list;
}

TEST(TrackingViews, LieBetweenTheStationsTheyWereRecordedBetween) {
  for (const bool clockwise : {false, true}) {
    const auto stations =
        stations_between(passed(4, clockwise), {1, 2, 3, 5, 46, 49}, clockwise, 40);
    ASSERT_EQ(stations.size(), 6u);
    EXPECT_NEAR(stations[0].azimuth_deg, 33.0 / 4, 1e-9);
    EXPECT_NEAR(stations[1].azimuth_deg, 33.0 / 2, 1e-9);
    EXPECT_NEAR(stations[3].azimuth_deg, 33 + 27.0 / 4, 1e-9);
    // From the last station of the first loop to the first of the second, past 360.
    EXPECT_NEAR(stations[4].azimuth_deg, 333 + 27.0 / 2, 1e-9);
    EXPECT_EQ(stations[5].loop, 1);
  }
}

TEST(TrackingViews, AStreamOfTheirOwnIsSpreadOverTheLoops) {
  std::vector<std::uint64_t> tracking;
  for (std::uint64_t s = 100; s < 172; ++s) tracking.push_back(s);
  const auto stations = stations_between(passed(1), tracking, false, 40);
  ASSERT_EQ(stations.size(), 72u);
  const double begin = stations[0].azimuth_deg;
  EXPECT_TRUE(begin >= 0 && begin <= 3) << begin;
  // Every other station deviates by 3 degrees: the median of a loop lies between.
  EXPECT_NEAR(stations[0].azimuth_deg, begin, 1e-9);
  EXPECT_NEAR(stations[7].azimuth_deg, begin + 70, 1e-9);
  EXPECT_EQ(stations[35].loop, 0);
  EXPECT_EQ(stations[36].loop, 1);
  EXPECT_NEAR(stations[36].azimuth_deg, begin, 1e-9);
}

TEST(TrackingViews, OneStationFarOffTurnsNoLoop) {
  std::vector<std::uint64_t> tracking;
  for (std::uint64_t s = 100; s < 172; ++s) tracking.push_back(s);
  std::vector<PassedStation> stations = passed(1);
  stations[0].azimuth_deg += 30;
  const auto between = stations_between(stations, tracking, false, 40);
  ASSERT_EQ(between.size(), 72u);
  EXPECT_LT(std::abs(between[0].azimuth_deg), 3.1);
  EXPECT_LT(std::abs(between[7].azimuth_deg - 70), 3.1);
}

TEST(TrackingViews, EmptySetsGiveNothing) {
  EXPECT_TRUE(stations_between({}, {1, 2}, false, 0).empty());
  EXPECT_TRUE(stations_between(passed(1), {}, false, 0).empty());
}

TEST(TrackingViews, ThinnedEvenlyToTheLimit) {
  std::vector<FrameRecord> frames(1000);
  std::vector<const FrameRecord*> list;
  for (const FrameRecord& f : frames) list.push_back(&f);
  EXPECT_EQ(thinned(list, 2000).size(), 1000u);
  const auto few = thinned(list, 96);
  ASSERT_EQ(few.size(), 96u);
  EXPECT_EQ(few.front(), &frames.front());
  EXPECT_EQ(few[48], &frames[500]);
}

}  // namespace
}  // namespace orbitfuse
