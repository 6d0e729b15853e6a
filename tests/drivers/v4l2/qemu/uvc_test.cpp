// SPDX-License-Identifier: BSD-3-Clause
// The kernel's own uvcvideo driver with a camera of ours that fails on script.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "tests/drivers/v4l2/qemu/recording.hpp"
#include "tests/drivers/v4l2/qemu/uvc_camera.hpp"

namespace orbitfuse::v4l2::guest {
namespace {

using namespace std::chrono_literals;

/// Whether uvcvideo hands out damaged frames (flagged) instead of withholding them.
void set_nodrop(bool on) {
  std::ofstream parameter("/sys/module/uvcvideo/parameters/nodrop");
  parameter << (on ? "1" : "0") << std::flush;
  ASSERT_TRUE(parameter.good());
}

bool wait_for_node(const std::string& serial) {
  const auto system = make_video_system();
  for (int i = 0; i < 600; ++i) {
    if (find_camera(*system, {CameraName::By::serial, serial})) return true;
    std::this_thread::sleep_for(50ms);
  }
  ADD_FAILURE() << "no node appeared for " << serial;
  return false;
}

/// Begins when the cameras of the test before are gone, with uvcvideo as it is by default.
class Uvc : public testing::Test {
 protected:
  void SetUp() override {
    set_nodrop(false);
    const auto system = make_video_system();
    const auto is_ours = [](const VideoSystem::Node& node) { return node.usb_id == "1209:0001"; };
    for (int i = 0; i < 600; ++i) {
      const auto nodes = system->nodes();
      if (std::none_of(nodes.begin(), nodes.end(), is_ours)) return;
      std::this_thread::sleep_for(50ms);
    }
    FAIL() << "a camera that was unplugged is still there";
  }
};

V4l2Options options_for(const std::string& serial, const std::string& format = "YUYV") {
  V4l2Options options;
  options.camera = "serial:" + serial;
  options.format = format;
  options.stall = 3s;  // a virtual machine may sleep for a while
  if (format == "Y16") {
    options.modality = Modality::thermal;
    options.device_id = "thermal0";
    options.kelvin_per_dn = 0.01;
  }
  return options;
}

std::unique_ptr<UvcCamera> plug_in(const std::string& serial, double rate_hz = 10) {
  auto camera = std::make_unique<UvcCamera>(serial, rate_hz);
  wait_for_node(serial);
  return camera;
}

/// A camera that has been recorded for some frames.
struct Recorded {
  Recorded(const std::string& serial, std::uint64_t frames, const std::string& format = "YUYV",
           double rate_hz = 10)
      : camera(plug_in(serial, rate_hz)), recording(options_for(serial, format)) {
    EXPECT_TRUE(recording.wait_for_frames(frames));
  }
  std::unique_ptr<UvcCamera> camera;
  Recording recording;
};

/// The numbers that the stored pictures show, by frame id: each exactly a frame that was sent
/// whole, in order.
std::map<std::uint64_t, int> expect_true_frames(const Session& session, const UvcCamera& camera) {
  const std::set<int> faulty = camera.faulty_frames();
  std::map<std::uint64_t, int> numbers;
  for (const FrameRecord& frame : session.frames) {
    const auto number =
        shown_number(cv::imread(session.path_of(frame).string(), cv::IMREAD_UNCHANGED));
    if (!number) {
      ADD_FAILURE() << frame.file << " is not a frame that was sent";
      continue;
    }
    EXPECT_FALSE(faulty.contains(*number)) << "frame " << *number << " was damaged and is stored";
    if (!numbers.empty()) {
      EXPECT_GT(frame.sequence, numbers.rbegin()->first);
      EXPECT_GT(*number, numbers.rbegin()->second);
    }
    numbers[frame.sequence] = *number;
  }
  return numbers;
}

/// Between any two stored frames as many ids were counted as the camera began frames.
void expect_ids_tell_the_truth(const std::map<std::uint64_t, int>& numbers) {
  ASSERT_FALSE(numbers.empty());
  const auto [first_id, first_number] = *numbers.begin();
  for (const auto& [id, number] : numbers) {
    EXPECT_EQ(static_cast<int>(id - first_id), number - first_number) << "at id " << id;
  }
}

class UvcFormats : public Uvc, public testing::WithParamInterface<const char*> {};

TEST_P(UvcFormats, CleanStreamIsExact) {
  Recorded recorded("OF-CLEAN", 15, GetParam());
  auto& [camera, recording] = recorded;
  const Session session = recording.finish();
  expect_ids_tell_the_truth(expect_true_frames(session, *camera));
  EXPECT_EQ(session.devices.at(0).serial, "OF-CLEAN");
  EXPECT_EQ(count_events(session, "disconnected") + count_events(session, "stalled"), 0);
}

INSTANTIATE_TEST_SUITE_P(All, UvcFormats, testing::Values("YUYV", "MJPG", "Y16"),
                         [](const auto& test) { return std::string(test.param); });

TEST_F(Uvc, MjpegIsStoredByteForByte) {
  Recorded recorded("OF-JPEG", 3, "MJPG");
  auto& [camera, recording] = recorded;
  const Session session = recording.finish();
  for (const FrameRecord& frame : session.frames) {
    const std::string stored = test::get(session.path_of(frame));
    const auto number =
        shown_number(cv::imread(session.path_of(frame).string(), cv::IMREAD_UNCHANGED));
    ASSERT_TRUE(number);
    const Bytes sent = picture(Format::mjpeg, *number);
    EXPECT_EQ(stored, std::string(sent.begin(), sent.end()));
  }
}

struct Damage {
  Fault fault;
  bool nodrop;
  const char* format;
  const char* name;
};

class UvcDamage : public Uvc, public testing::WithParamInterface<Damage> {};

TEST_P(UvcDamage, IsCountedAndNeverStored) {
  const Damage& damage = GetParam();
  set_nodrop(damage.nodrop);
  Recorded recorded("OF-DAMAGE", 3, damage.format);
  auto& [camera, recording] = recorded;
  for (int i = 0; i < 3; ++i) {
    camera->fail_next(damage.fault);
    EXPECT_TRUE(recording.wait_for_frames(3));
  }
  const StreamStatus counts = recording.status();
  const Session session = recording.finish();
  EXPECT_EQ(camera->faulty_frames().size(), 3u);
  expect_ids_tell_the_truth(expect_true_frames(session, *camera));
  // Withheld by the driver they are holes in its sequence; handed out they are rejected.
  const bool seen = damage.nodrop || std::string(damage.format) == "MJPG";
  EXPECT_GE(seen ? counts.rejected : counts.missing, 3u);
  if (!seen) {
    EXPECT_EQ(counts.rejected, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(All, UvcDamage,
                         testing::Values(Damage{Fault::cut, false, "YUYV", "CutWithheld"},
                                         Damage{Fault::cut, true, "YUYV", "CutHandedOut"},
                                         Damage{Fault::cut, false, "MJPG", "CutJpeg"},
                                         Damage{Fault::error, false, "YUYV", "ErrorBitWithheld"},
                                         Damage{Fault::error, true, "YUYV", "ErrorBitHandedOut"},
                                         Damage{Fault::error, true, "Y16", "ErrorBitThermal"}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_F(Uvc, SlowReaderSeesWhatTheDriverDropped) {
  const auto camera = plug_in("OF-SLOW");
  V4l2Source source(options_for("OF-SLOW"));
  ASSERT_TRUE(source.start());
  std::map<std::uint64_t, int> numbers;
  for (int i = 0; i < 400 && numbers.size() < 12; ++i) {
    const Result<Delivery> delivery = source.next(200ms);
    ASSERT_TRUE(delivery);
    if (delivery->kind != Delivery::Kind::frame) continue;
    const auto number = shown_number(delivery->frame.pixels);
    ASSERT_TRUE(number);
    numbers[delivery->frame.id] = *number;
    if (numbers.size() == 4) {  // longer than the buffers last
      const int begun = camera->frames_begun();
      for (int wait = 0; wait < 600 && camera->frames_begun() < begun + 8; ++wait)
        std::this_thread::sleep_for(50ms);
    }
  }
  EXPECT_EQ(numbers.size(), 12u);
  expect_ids_tell_the_truth(numbers);
  EXPECT_GT(numbers.rbegin()->first - numbers.begin()->first, 11u) << "nothing was dropped";
}

TEST_F(Uvc, SilentStreamIsFlaggedAndResumed) {
  Recorded recorded("OF-SILENT", 4);
  auto& [camera, recording] = recorded;
  camera->fall_silent();
  EXPECT_TRUE(recording.wait_until([](const StreamStatus& s) { return s.silent; }));
  EXPECT_TRUE(recording.wait_for_frames(4));
  const Session session = recording.finish();
  expect_true_frames(session, *camera);
  EXPECT_EQ(count_events(session, "stalled"), 1);
  EXPECT_EQ(count_events(session, "reconnected"), 1);
  EXPECT_GE(session.gaps.size(), 1u);
}

TEST_F(Uvc, HaltedEndpointIsFlaggedAndResumed) {
  Recorded recorded("OF-HALT", 4);
  auto& [camera, recording] = recorded;
  camera->halt_endpoint();
  EXPECT_TRUE(recording.wait_for_frames(6));
  const Session session = recording.finish();
  expect_true_frames(session, *camera);
  EXPECT_GE(count_events(session, "disconnected") + count_events(session, "stalled"), 1);
  EXPECT_GE(count_events(session, "reconnected"), 1);
}

TEST_F(Uvc, ReplugUnderAnotherNodeGoesOnWithTheSameCamera) {
  Recorded recorded("OF-0001", 4);
  auto& [camera, recording] = recorded;
  const auto system = make_video_system();
  const CameraName name{CameraName::By::serial, "OF-0001"};
  const std::string before = find_camera(*system, name)->path;
  camera->unplug();
  EXPECT_TRUE(recording.wait_until([](const StreamStatus& s) { return s.silent; }));
  const StreamStatus away = recording.status();
  // Another camera takes the number that became free; it must not be taken for ours.
  const auto stranger = plug_in("OF-9999");
  camera = plug_in("OF-0001");
  const std::string after = find_camera(*system, name)->path;
  EXPECT_TRUE(recording.wait_for_frames(4));
  const Session session = recording.finish();

  EXPECT_NE(before, after);
  EXPECT_EQ(stranger->frames_begun(), 0);
  EXPECT_EQ(count_events(session, "disconnected"), 1);
  EXPECT_EQ(count_events(session, "reconnected"), 1);
  ASSERT_EQ(session.gaps.size(), 1u);  // the outage
  EXPECT_GT(session.gaps[0].first_sequence, away.last_id);
  for (const FrameRecord& frame : session.frames) {
    EXPECT_TRUE(shown_number(cv::imread(session.path_of(frame).string()))) << frame.file;
  }
}

TEST_F(Uvc, ReplugRestoresTheLockedSettings) {
  auto camera = std::make_unique<UvcCamera>("OF-LOCK");
  camera->set_exposure_100us(312);  // what its automatic found at the first station
  ASSERT_TRUE(wait_for_node("OF-LOCK"));
  Recording recording(options_for("OF-LOCK"));
  EXPECT_TRUE(recording.wait_for_frames(2));
  const auto expect_locked = [&] {
    // The first time once it has adapted for a second.
    EXPECT_TRUE(recording.wait_until([&](const StreamStatus&) {
      return camera->exposure_mode() == 1u && camera->white_balance_auto() == 0u;
    }));
    EXPECT_EQ(camera->exposure_mode(), 1u);
    EXPECT_EQ(camera->exposure_100us(), 312u);
    EXPECT_EQ(camera->white_balance_auto(), 0u);
    EXPECT_EQ(camera->white_balance_k(), 4600u);
  };
  expect_locked();
  camera->unplug();
  EXPECT_TRUE(recording.wait_until([](const StreamStatus& s) { return s.silent; }));
  camera = std::make_unique<UvcCamera>("OF-LOCK");  // switched off and on: automatic again
  EXPECT_NE(camera->exposure_100us(), 312u);
  EXPECT_TRUE(recording.wait_for_frames(2));
  expect_locked();
  const Session session = recording.finish();
  EXPECT_EQ(count_events(session, "setting-lost"), 0);
}

TEST_F(Uvc, UnpluggedForGoodEndsInOrder) {
  Recorded recorded("OF-GONE", 4);
  auto& [camera, recording] = recorded;
  camera->unplug();
  EXPECT_TRUE(recording.wait_until([](const StreamStatus& s) { return s.silent; }));
  const Session session = recording.finish();  // does not hang
  expect_ids_tell_the_truth(expect_true_frames(session, *camera));
  EXPECT_EQ(count_events(session, "disconnected"), 1);
  EXPECT_EQ(count_events(session, "reconnected"), 0);
}

/// A frame of which nothing arrives leaves no hole in the driver's count: only time tells.
TEST_F(Uvc, FrameLostWholeIsTold) {
  Recorded recorded("OF-LATE", 10, "YUYV", 5);
  auto& [camera, recording] = recorded;
  camera->fail_next(Fault::lost);
  camera->fail_next(Fault::lost);
  camera->fail_next(Fault::lost);
  EXPECT_TRUE(recording.wait_for_frames(4));
  const Session session = recording.finish();
  expect_true_frames(session, *camera);
  EXPECT_GE(count_events(session, "late-frame"), 1);
}

}  // namespace
}  // namespace orbitfuse::v4l2::guest
