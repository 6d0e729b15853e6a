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
  EXPECT_TRUE(recording.wait_until(
      [](const StreamStatus& s) { return s.received >= 5 && s.missing >= 3; }));
  const Session session = recording.finish();
  set_control("Percentage of Dropped Buffers", 0);
  EXPECT_GE(session.streams.at(0).lost, 3u);
}

TEST(Vivid, FlaggedFramesAreRejected) {
  Recording recording(options_for("YUYV", Modality::visible));
  EXPECT_TRUE(recording.wait_for_frames(2));
  set_control("Inject V4L2_BUF_FLAG_ERROR", 1);
  EXPECT_TRUE(recording.wait_until([](const StreamStatus& s) { return s.rejected == 1; }));
  EXPECT_TRUE(recording.wait_for_frames(2));
  EXPECT_EQ(recording.finish().streams.at(0).lost, 1u);
}

/// The driver's queue fails for good, as after a fault of the hardware; or the device goes away.
class VividFailure : public testing::TestWithParam<const char*> {};

TEST_P(VividFailure, IsFlaggedAndTheStreamResumed) {
  Recording recording(options_for("GREY", Modality::visible));
  EXPECT_TRUE(recording.wait_for_frames(2));
  set_control(GetParam(), 1);
  EXPECT_TRUE(recording.wait_for_frames(4));
  const Session session = recording.finish();
  EXPECT_EQ(count_events(session, "disconnected"), 1);
  EXPECT_EQ(count_events(session, "reconnected"), 1);
  EXPECT_EQ(session.gaps.size(), 1u);
}

INSTANTIATE_TEST_SUITE_P(All, VividFailure,
                         testing::Values("Inject Fatal Streaming Error", "Disconnect"),
                         [](const auto& test) {
                           return std::string(test.param[0] == 'D' ? "Disconnect" : "Queue");
                         });

TEST(Vivid, HeldByAnotherProgramIsAnErrorWithARemedy) {
  V4l2Source first(options_for("YUYV", Modality::visible)),
      second(options_for("YUYV", Modality::visible));
  ASSERT_TRUE(first.start());
  const Status status = second.start();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_NE(status.error().remedy.find("other program"), std::string::npos)
      << status.error().message();
}

TEST(Vivid, SizeThatItDoesNotHaveIsRefused) {
  V4l2Options options = options_for("YUYV", Modality::visible);
  options.width = 322;
  V4l2Source source(options);
  const Status status = source.start();
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message().find("322x180"), std::string::npos)
      << status.error().message();
}

}  // namespace
}  // namespace orbitfuse::v4l2::guest
