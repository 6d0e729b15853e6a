// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_frames.hpp"

#include <gtest/gtest.h>

#include <deque>

namespace orbitfuse {
namespace {

struct Frames {
  std::deque<FrameRecord> records;
  std::vector<const FrameRecord*> list;

  FrameRecord& add(const std::string& device, int width, bool station, bool tracking = false) {
    FrameRecord& frame = records.emplace_back();
    frame.file = device + "/" + std::to_string(records.size());
    frame.device = device;
    frame.width = width, frame.height = width * 3 / 4;
    frame.sequence = records.size();
    frame.tracking = tracking;
    if (station) frame.station.emplace();
    list.push_back(&frame);
    return frame;
  }
};

TEST(OrbitFrames, ViewsOfAnotherCameraOrSizeAreNamed) {
  Frames frames;
  frames.add("thermal1", 320, true);
  for (int i = 0; i < 5; ++i) frames.add("thermal0", 640, true);
  frames.add("thermal0", 320, true);
  frames.add("thermal0", 640, false);
  frames.add("thermal0", 640, false, true);
  frames.add("thermal1", 320, false, true);
  const auto orbit = orbit_frames(frames.list, 96);
  ASSERT_TRUE(orbit) << orbit.error().message();
  EXPECT_EQ(orbit->stations.size(), 5U);
  ASSERT_EQ(orbit->tracking.size(), 1U);
  EXPECT_EQ(orbit->tracking[0]->device, "thermal0");
  ASSERT_EQ(orbit->left_out.size(), 3U);
  EXPECT_EQ(orbit->left_out[0].first, "thermal1/1");
  EXPECT_NE(orbit->left_out[1].second.find("size"), std::string::npos);
  EXPECT_NE(orbit->left_out[2].second.find("no station"), std::string::npos);
}

TEST(OrbitFrames, WithoutStationsTheOrderCounts) {
  Frames frames;
  for (int i = 0; i < 8; ++i)
    frames.add("thermal0", 640, false).sequence = 100 - frames.list.size();
  const auto orbit = orbit_frames(frames.list, 96);
  ASSERT_TRUE(orbit) << orbit.error().message();
  ASSERT_EQ(orbit->stations.size(), 8U);
  EXPECT_EQ(orbit->stations.front()->file, "thermal0/8");
  EXPECT_TRUE(orbit->left_out.empty());
  frames.list.pop_back();
  ASSERT_FALSE(orbit_frames(frames.list, 96));
  EXPECT_EQ(orbit_frames(frames.list, 96).error().kind, ErrorKind::quality);
  EXPECT_FALSE(orbit_frames({}, 96));
}

}  // namespace
}  // namespace orbitfuse
