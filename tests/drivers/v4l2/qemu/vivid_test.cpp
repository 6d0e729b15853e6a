// SPDX-License-Identifier: BSD-3-Clause
// The kernel's virtual video driver: formats, sizes, controls, sequence numbers, scripted errors.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <string>

#include "tests/drivers/v4l2/qemu/recording.hpp"

namespace orbitfuse::v4l2::guest {
namespace {

const std::string vivid = "/dev/video0";

/// Sets vivid's control of this name through a file descriptor of its own.
void set_control(const std::string& name, int value) {
  const int fd = ::open(vivid.c_str(), O_RDWR | O_NONBLOCK);
  ASSERT_GE(fd, 0);
  v4l2_queryctrl query{};
  bool found = false;
  for (query.id = V4L2_CTRL_FLAG_NEXT_CTRL; !found && ::ioctl(fd, VIDIOC_QUERYCTRL, &query) == 0;
       query.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
    if (name != reinterpret_cast<const char*>(query.name)) continue;
    found = true;
    v4l2_control control{query.id, value};
    EXPECT_EQ(::ioctl(fd, VIDIOC_S_CTRL, &control), 0) << name;
  }
  EXPECT_TRUE(found) << "vivid has no control " << name;
  ::close(fd);
}

V4l2Options options_for(const std::string& format, Modality modality) {
  V4l2Options options;
  options.camera = vivid;
  options.format = format;
  options.modality = modality;
  options.device_id = modality == Modality::thermal ? "thermal0" : "visible0";
  options.width = 320;
  options.height = 180;
  return options;
}

class VividFormats : public testing::TestWithParam<std::pair<const char*, Modality>> {};

TEST_P(VividFormats, StreamIntoASession) {
  Recording recording(options_for(GetParam().first, GetParam().second));
  EXPECT_TRUE(recording.wait_for_frames(5));
  const Session session = recording.finish();
  ASSERT_GE(session.frames.size(), 5u);
}

INSTANTIATE_TEST_SUITE_P(All, VividFormats,
                         testing::Values(std::pair("YUYV", Modality::visible),
                                         std::pair("NV12", Modality::visible),
                                         std::pair("GREY", Modality::visible),
                                         std::pair("GREY", Modality::thermal),
                                         std::pair("Y16", Modality::thermal)),
                         [](const auto& test) {
                           return std::string(test.param.first) +
                                  (test.param.second == Modality::thermal ? "Thermal" : "Visible");
                         });

TEST(Vivid, DroppedFramesAreGapsOfTheSequence) {
  set_control("Percentage of Dropped Buffers", 30);
  Recording recording(options_for("GREY", Modality::visible));
  EXPECT_TRUE(recording.wait_until([](const StreamStatus& s) { return s.received >= 5 && s.missing >= 3; }));
  const Session session = recording.finish();
  set_control("Percentage of Dropped Buffers", 0);
  EXPECT_GE(session.streams.at(0).lost, 3u);
}

}  // namespace
}  // namespace orbitfuse::v4l2::guest
