// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/v4l2/v4l2_source.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <atomic>
#include <cerrno>
#include <cmath>
#include <thread>

#include "tests/drivers/v4l2/fake_video_system.hpp"

namespace orbitfuse::v4l2 {
namespace {

using namespace std::chrono_literals;
using Kind = Delivery::Kind;

class V4l2SourceTest : public testing::Test {
 protected:
  V4l2SourceTest() {
    system->fourcc = V4L2_PIX_FMT_GREY;
    options.stall = 20ms;
    options.reopen_every = 1ms;
  }
  void shoot(std::uint32_t sequence, std::uint32_t flags = 0, std::size_t bytes = 32) {
    system->shots.push_back({sequence, flags,
                             std::vector<std::uint8_t>(bytes, static_cast<std::uint8_t>(sequence)),
                             0});
  }
  /// The next delivery that is not a timeout; at most a second.
  Delivery deliver(V4l2Source& source) {
    for (int i = 0; i < 1000; ++i) {
      const Result<Delivery> delivery = source.next(1ms);
      EXPECT_TRUE(delivery);
      if (delivery->kind != Kind::timeout) return *delivery;
      std::this_thread::sleep_for(1ms);
    }
    ADD_FAILURE() << "nothing came";
    return {};
  }
  void unplug(V4l2Source& source) {
    system->plugged = false;
    EXPECT_EQ(deliver(source).reason, "disconnected");
  }
  void unplug_after_a_frame(V4l2Source& source) {
    shoot(0);
    EXPECT_EQ(deliver(source).kind, Kind::frame);
    unplug(source);
  }

  void note_resets() {
    options.reset_port = [this](const std::string& port) -> Status {
      resets.push_back(port);
      return {};
    };
  }
  /// The second stall in a row: its port was reset, and frames come again.
  void expect_reset_and_frames(V4l2Source& source, const std::string& detail) {
    const Delivery again = deliver(source);
    EXPECT_EQ(again.reason, "stalled");
    EXPECT_NE(again.detail.find(detail), std::string::npos);
    EXPECT_EQ(resets, std::vector<std::string>{"1-4"});
    EXPECT_EQ(deliver(source).reason, "reconnected");
    shoot(0);
    EXPECT_EQ(deliver(source).kind, Kind::frame);
  }

  std::vector<std::string> resets;
  std::shared_ptr<FakeVideoSystem> system = std::make_shared<FakeVideoSystem>();
  V4l2Options options;
};

TEST_F(V4l2SourceTest, SequenceGapsAreIdGaps) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  for (std::uint32_t sequence : {5u, 6u, 9u}) shoot(sequence);
  EXPECT_EQ(deliver(source).frame.id, 0u);
  EXPECT_EQ(deliver(source).frame.id, 1u);
  const Delivery third = deliver(source);
  EXPECT_EQ(third.frame.id, 4u);
  EXPECT_EQ(third.frame.pixels.at<std::uint8_t>(3, 7), 9);
}

TEST_F(V4l2SourceTest, SequenceWrapsAt32Bits) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  for (std::uint32_t sequence : {0xfffffffeu, 0xffffffffu, 0u, 2u, 2u}) shoot(sequence);
  for (std::uint64_t id : {0u, 1u, 2u, 4u, 5u}) EXPECT_EQ(deliver(source).frame.id, id);
}

TEST_F(V4l2SourceTest, DamagedFramesAreRejectedNeverStored) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  shoot(0, V4L2_BUF_FLAG_ERROR);
  shoot(1, 0, 31);                                                       // one byte short of 8x4
  system->shots.push_back({2, 0, std::vector<std::uint8_t>(32), 5000});  // more than its buffer
  shoot(3);
  for (std::uint64_t id : {0u, 1u, 2u}) {
    const Delivery delivery = deliver(source);
    EXPECT_EQ(delivery.kind, Kind::rejected);
    EXPECT_EQ(delivery.frame.id, id);
    EXPECT_FALSE(delivery.reason.empty());
  }
  EXPECT_EQ(deliver(source).kind, Kind::frame);
}

TEST_F(V4l2SourceTest, BuffersGivenBackEmptyAreNoFrames) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  for (std::uint32_t sequence : {0u, 1u, 2u}) shoot(sequence), deliver(source);
  shoot(1, V4L2_BUF_FLAG_ERROR, 0);  // an old number: what the buffer held before
  EXPECT_EQ(deliver(source).reason, "disconnected");
  EXPECT_EQ(deliver(source).reason, "reconnected");
  shoot(0, V4L2_BUF_FLAG_ERROR, 0);  // before any frame of the new stream
  shoot(0);
  shoot(1, V4L2_BUF_FLAG_ERROR, 0);  // a new number: a frame that came damaged
  EXPECT_EQ(deliver(source).kind, Kind::frame);
  EXPECT_EQ(deliver(source).kind, Kind::rejected);
}

TEST_F(V4l2SourceTest, StreamsOfEmptyBuffersAreAStallAndGetTheirPortReset) {
  note_resets();
  options.stall = 10s;  // it is not silence that ends these streams
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  const auto shoot_empty = [&] {
    for (int i = 0; i <= options.buffers; ++i) shoot(0, V4L2_BUF_FLAG_ERROR, 0);
  };
  shoot_empty();
  EXPECT_EQ(deliver(source).reason, "stalled");
  EXPECT_EQ(deliver(source).reason, "reconnected");
  EXPECT_TRUE(resets.empty());
  shoot_empty();
  expect_reset_and_frames(source, "empty buffers");
}

TEST_F(V4l2SourceTest, AStreamThatBreaksBeforeItsFirstFrameEscalatesToo) {
  note_resets();
  options.stall = 10s;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  for (std::size_t i = 0; i < 2; ++i) {
    shoot(0);
    system->dequeue_error = EIO;
    EXPECT_EQ(deliver(source).reason, "stalled");
    EXPECT_EQ(deliver(source).reason, "reconnected");
    EXPECT_EQ(resets.size(), i);
  }
  system->dequeue_error = 0;
  EXPECT_EQ(deliver(source).kind, Kind::frame);
}

TEST_F(V4l2SourceTest, EveryOutageCostsItsTimeInIds) {
  options.stall = 10s;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  // 100 Hz by the driver's stamps.
  for (std::uint32_t i = 0; i < 20; ++i)
    shoot(i), system->shots.back().stamp_us = 1'000'000 + 10'000 * i;
  std::uint64_t last = 0;
  for (int i = 0; i < 20; ++i) last = deliver(source).frame.id;
  const auto outage = [&](std::chrono::milliseconds away) {
    unplug(source);
    std::this_thread::sleep_for(away);
    system->plugged = true;
    EXPECT_EQ(deliver(source).reason, "reconnected");
  };
  const auto lost_at = std::chrono::steady_clock::now();
  const auto frames_since = [](auto start) {
    return 100 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  outage(200ms);
  outage(300ms);  // before a frame came: its time adds to the first's
  shoot(0);
  system->shots.back().stamp_us = 10'000'000;
  const Delivery back = deliver(source);
  const double first_two = static_cast<double>(back.frame.id - last - 1);
  EXPECT_GE(first_two, 49);
  EXPECT_LE(first_two, frames_since(lost_at) + 2);
  const auto lost_again = std::chrono::steady_clock::now();
  outage(200ms);
  shoot(0);
  const double third = static_cast<double>(deliver(source).frame.id - back.frame.id - 1);
  EXPECT_GE(third, 19);
  EXPECT_LE(third, frames_since(lost_again) + 2);
}

TEST_F(V4l2SourceTest, BackButRefusedIsToldOnceWithItsReason) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  unplug(source);
  system->stream_on_error = ENOSPC;
  system->plugged = true;
  const Delivery refused = deliver(source);
  EXPECT_EQ(refused.reason, "reopen-failed");
  EXPECT_NE(refused.detail.find("bandwidth"), std::string::npos) << refused.detail;
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(source.next(1ms)->kind, Kind::timeout);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(system->open_descriptors, 0);
  EXPECT_EQ(system->mapped, 0);
  system->stream_on_error = 0;
  EXPECT_EQ(deliver(source).reason, "reconnected");
}

TEST_F(V4l2SourceTest, FrozenThermalFramesAreFlagged) {
  options.modality = Modality::thermal;
  options.stall = 10s;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  for (std::uint32_t sequence : {0u, 1u}) shoot(sequence);
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(deliver(source).frame.flags.empty());
  shoot(2);
  system->shots.back().bytes.assign(32, 1);  // as the frame before: the shutter is closed
  EXPECT_EQ(deliver(source).frame.flags, std::vector<std::string>{"nuc"});
  EXPECT_EQ(deliver(source).reason, "nuc");
  shoot(3);
  EXPECT_EQ(deliver(source).frame.flags, std::vector<std::string>{"nuc"}) << "it still drifts";
  options.modality = Modality::visible;  // a dark room is no shutter
  V4l2Source photos(options, system);
  ASSERT_TRUE(photos.start());
  for (int i = 0; i < 3; ++i) {
    shoot(static_cast<std::uint32_t>(i));
    system->shots.back().bytes.assign(32, 1);
    EXPECT_TRUE(deliver(photos).frame.flags.empty());
  }
}

TEST_F(V4l2SourceTest, UnpluggedAndBackUnderAnotherNode) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  unplug_after_a_frame(source);
  EXPECT_EQ(system->open_descriptors, 0);
  EXPECT_EQ(system->mapped, 0);
  EXPECT_EQ(source.next(1ms)->kind, Kind::timeout);
  system->camera.path = "/dev/video6";
  system->plugged = true;
  const Delivery back = deliver(source);
  EXPECT_EQ(back.reason, "reconnected");
  EXPECT_NE(back.detail.find("/dev/video6"), std::string::npos);
  shoot(0);                                 // the driver counts from 0 again
  EXPECT_EQ(deliver(source).frame.id, 2u);  // one frame's time at least was lost
}

/// For the thread sanitizer too: the recorder's writer asks while the capture thread reopens.
/// What a camera like the session's does in another port.
class V4l2TwinTest : public V4l2SourceTest {
 protected:
  V4l2TwinTest() : first(system->camera), second(system->camera) {
    second.path = "/dev/video3";
    second.usb_path = "2-1";
  }
  void plug(const VideoSystem::Node& node) {
    system->camera = node;
    system->plugged = true;
  }
  VideoSystem::Node first, second;
};

TEST_F(V4l2TwinTest, OneOfTheSameSerialElsewhereIsTakenButToldAndGivenUpForTheFirst) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  unplug_after_a_frame(source);
  plug(second);
  EXPECT_EQ(deliver(source).reason, "reconnected");
  const Delivery moved = deliver(source);
  EXPECT_EQ(moved.reason, "moved");
  EXPECT_NE(moved.detail.find("usb:2-1"), std::string::npos);
  EXPECT_NE(moved.detail.find("usb:1-4"), std::string::npos);
  shoot(0);
  EXPECT_EQ(deliver(source).frame.flags, std::vector<std::string>{"other-port"});
  // The first one is plugged in again: there are two.
  system->others = {first};
  EXPECT_EQ(deliver(source).reason, "twin");
  EXPECT_EQ(deliver(source).reason, "reconnected");
  EXPECT_EQ(system->last_opened, first.path);
  shoot(0);
  EXPECT_TRUE(deliver(source).frame.flags.empty());
  // From now on its port alone counts.
  system->others.clear();
  plug(second);
  system->dequeue_error = ENODEV;
  shoot(1);
  EXPECT_EQ(deliver(source).reason, "disconnected");
  system->dequeue_error = 0;
  EXPECT_EQ(deliver(source).reason, "look-alike");
  for (int i = 0; i < 20; ++i) EXPECT_EQ(source.next(1ms)->kind, Kind::timeout);
  EXPECT_EQ(system->last_opened, first.path);
}

TEST_F(V4l2TwinTest, ATwinThatWasThereAllAlongIsNeverTaken) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  system->others = {second};  // while ours streams
  unplug_after_a_frame(source);
  EXPECT_EQ(deliver(source).reason, "look-alike");
  for (int i = 0; i < 20; ++i) EXPECT_EQ(source.next(1ms)->kind, Kind::timeout);
  EXPECT_EQ(system->last_opened, first.path);
  plug(first);
  const Delivery back = deliver(source);
  EXPECT_EQ(back.reason, "reconnected");
  EXPECT_NE(back.detail.find("by its port"), std::string::npos);
}

TEST_F(V4l2TwinTest, WithoutASerialOnlyThePortCounts) {
  system->camera.serial.clear();
  first.serial.clear();
  second.serial.clear();
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  unplug_after_a_frame(source);
  plug(second);
  const Delivery told = deliver(source);
  EXPECT_EQ(told.reason, "look-alike");
  EXPECT_NE(told.detail.find("usb:1-4"), std::string::npos);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(source.next(1ms)->kind, Kind::timeout) << "told once";
  EXPECT_EQ(system->open_descriptors, 0);
  plug(first);
  EXPECT_EQ(deliver(source).reason, "reconnected");
}

TEST_F(V4l2SourceTest, DescribesItselfToOtherThreadsWhileItReopens) {
  system->camera.product = std::string(200, 'p');
  system->camera.serial = std::string(200, 's');
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  std::atomic<bool> over = false;
  std::thread asking([&] {
    while (!over) {
      const DeviceInfo info = source.describe();
      EXPECT_EQ(info.model, std::string(200, 'p'));
      EXPECT_EQ(info.serial, std::string(200, 's'));
    }
  });
  for (int i = 0; i < 50; ++i) {
    unplug(source);
    system->plugged = true;
    EXPECT_EQ(deliver(source).reason, "reconnected");
  }
  over = true;
  asking.join();
}

TEST_F(V4l2SourceTest, StallIsToldAndReopened) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(deliver(source).reason, "stalled");
  EXPECT_EQ(deliver(source).reason, "reconnected");
  EXPECT_EQ(system->streams_started, 2);
  shoot(0);
  EXPECT_EQ(deliver(source).kind, Kind::frame);
}

TEST_F(V4l2SourceTest, HungCameraGetsItsPortReset) {
  note_resets();
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(deliver(source).reason, "stalled");
  EXPECT_EQ(deliver(source).reason, "reconnected");
  EXPECT_TRUE(resets.empty());  // reopening alone comes first
  expect_reset_and_frames(source, "reset");
  EXPECT_EQ(deliver(source).reason, "stalled");
  EXPECT_EQ(resets.size(), 1u);
}

TEST_F(V4l2SourceTest, StartErrorsNameTheRemedyAndLeakNothing) {
  struct Case {
    int open_error, stream_on_error;
    const char* remedy;
  };
  for (const Case& c : {Case{EBUSY, 0, "other program"}, Case{EACCES, 0, "group video"},
                        Case{0, ENOSPC, "bandwidth"}}) {
    system->open_error = c.open_error;
    system->stream_on_error = c.stream_on_error;
    V4l2Source source(options, system);
    const Status status = source.start();
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().kind, ErrorKind::device);
    EXPECT_NE(status.error().remedy.find(c.remedy), std::string::npos) << status.error().message();
    EXPECT_EQ(system->open_descriptors, 0);
    EXPECT_EQ(system->mapped, 0);
  }
}

TEST_F(V4l2SourceTest, AnotherSizeThanAskedIsRefused) {
  options.width = 640;
  options.height = 480;
  V4l2Source source(options, system);
  const Status status = source.start();
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message().find("8x4"), std::string::npos);
}

TEST_F(V4l2SourceTest, LocksExposureAndTellsWhenItDoesNotHold) {
  system->controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY},
                      {V4L2_CID_EXPOSURE_ABSOLUTE, 150}};
  options.exposure_100us = 80;
  {
    V4l2Source source(options, system);
    ASSERT_TRUE(source.start());
    EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
    EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 80);
  }
  system->exposure_sticks = false;
  options.exposure_100us = 40;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(deliver(source).reason, "setting-lost");
}

TEST_F(V4l2SourceTest, ControlsAreLockedOnceTheCameraHasAdaptedAndHoldAfterReplug) {
  const std::map<std::uint32_t, int> switched_on = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL},
                                                    {V4L2_CID_EXPOSURE_ABSOLUTE, 10}};
  system->controls = switched_on;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_APERTURE_PRIORITY);
  shoot(0);
  EXPECT_EQ(deliver(source).kind, Kind::frame);
  system->controls[V4L2_CID_EXPOSURE_ABSOLUTE] = 312;  // its automatic found this
  EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_APERTURE_PRIORITY);
  system->monotonic_step_ns += 1'000'000'000;
  shoot(1);
  EXPECT_EQ(deliver(source).kind, Kind::frame);
  EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 312);
  unplug(source);
  system->controls = switched_on;
  system->plugged = true;
  EXPECT_EQ(deliver(source).reason, "reconnected");
  EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 312);
}

TEST_F(V4l2SourceTest, UnlockedControlsStayAutomatic) {
  system->controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL}, {V4L2_CID_FOCUS_AUTO, 0}};
  options.lock_exposure = options.lock_focus = options.lock_white_balance = false;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  for (std::uint32_t i = 0; i < 3; ++i) {
    shoot(i);
    EXPECT_EQ(deliver(source).kind, Kind::frame);
    system->monotonic_step_ns += 2'000'000'000;
  }
  EXPECT_EQ(system->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_APERTURE_PRIORITY);
  EXPECT_EQ(system->controls[V4L2_CID_FOCUS_AUTO], 1);
}

TEST_F(V4l2SourceTest, ComesBackWithItsSizeOrNotAtAll) {
  options.stall = 10s;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  unplug_after_a_frame(source);
  system->width = 4;
  system->plugged = true;
  const Delivery refused = deliver(source);
  EXPECT_EQ(refused.reason, "reopen-failed");
  EXPECT_NE(refused.detail.find("4x4"), std::string::npos) << refused.detail;
  EXPECT_EQ(system->asked_width, 8);
  EXPECT_EQ(system->asked_height, 4);
  system->width = 8;
  EXPECT_EQ(deliver(source).reason, "reconnected");
  shoot(0);
  EXPECT_EQ(deliver(source).frame.pixels.cols, 8);
}

TEST_F(V4l2SourceTest, ImagesOfNoPixelsAreRefused) {
  system->width = 0;
  EXPECT_NE(V4l2Source(options, system).start().error().message().find("0 pixels"),
            std::string::npos);
}

TEST_F(V4l2SourceTest, HostTimesRiseWhenTheClockIsSetBackAndTheStepIsTold) {
  options.stall = 10s;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  std::int64_t before = 0;
  const std::int64_t start_us = system->now_ns(CLOCK_MONOTONIC) / 1000;
  bool told = false;
  for (std::uint32_t i = 0; i < 20; ++i) {
    if (i == 10) system->wall_step_ns = -5'000'000'000;
    system->monotonic_step_ns += 33'000'000;
    shoot(i, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC);
    system->shots.back().stamp_us = start_us + 33'000 * i;
    Delivery delivery = deliver(source);
    while (delivery.kind == Kind::event) {
      told |= delivery.reason == "clock";
      delivery = deliver(source);
    }
    EXPECT_GT(delivery.frame.host_time_ns, before) << i;
    before = delivery.frame.host_time_ns.value();
  }
  EXPECT_TRUE(told);
}

/// A 9 Hz sensor at 60 Hz, whose frames lie waiting while the host is busy.
TEST_F(V4l2SourceTest, ABusyHostIsNoShutter) {
  options.modality = Modality::thermal;
  options.stall = 10s;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  int flagged = 0;
  for (std::uint32_t i = 0; i < 60; ++i) {
    shoot(i, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC);
    system->shots.back().stamp_us = 1'000'000 + 16'667 * i;
    system->shots.back().bytes.assign(32, static_cast<std::uint8_t>(i * 9 / 60));
    if (i > 50) system->monotonic_step_ns += 300'000'000;
    if (i == 55) std::this_thread::sleep_for(300ms);
    Delivery delivery = deliver(source);
    while (delivery.kind == Kind::event) delivery = deliver(source);
    if (i > 50) flagged += !delivery.frame.flags.empty();
  }
  EXPECT_EQ(flagged, 0);
}

TEST_F(V4l2SourceTest, OptionsAreValidatedByName) {
  V4l2Options wrong = options;
  wrong.buffers = 1;
  EXPECT_NE(wrong.validate().error().where.find("buffers"), std::string::npos);
  wrong = options;
  wrong.format = "H264";
  EXPECT_FALSE(wrong.validate());
  wrong = options;
  wrong.width = 640;
  EXPECT_FALSE(wrong.validate());
  wrong = options;
  wrong.rate_hz = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(wrong.validate());
}

TEST_F(V4l2SourceTest, NextBeforeStartIsAnError) {
  V4l2Source source(options, system);
  EXPECT_FALSE(source.next(1ms));
  source.stop();
}

TEST_F(V4l2SourceTest, AnOutageAtTheEndIsCountedByTime) {
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  for (std::uint32_t i = 0; i < 20; ++i) {
    shoot(i);
    system->shots.back().stamp_us = 1'000'000 + 10'000 * i;  // 100 Hz
  }
  for (int i = 0; i < 20; ++i) EXPECT_EQ(deliver(source).kind, Kind::frame);
  unplug(source);
  const auto gone = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - gone < 200ms) source.next(1ms);
  const std::vector<Delivery> end = source.unfinished();
  ASSERT_EQ(end.size(), 1u);
  EXPECT_EQ(end[0].kind, Kind::lost);
  EXPECT_GE(end[0].frame.id, 19u + 20u);  // a fifth of a second of 100 Hz
}

TEST_F(V4l2SourceTest, HotSamplesKeepTheirTemperatureAndTheEndOfTheScaleIsTold) {
  system->fourcc = V4L2_PIX_FMT_Y16;
  options.modality = Modality::thermal;
  options.kelvin_per_dn = 0.04;
  V4l2Source source(options, system);
  ASSERT_TRUE(source.start());
  std::vector<std::uint8_t> bytes(64, 0x1d);  // 8 x 4 samples of 0x1d1d: 298 K
  bytes[0] = 29330 & 0xff;
  bytes[1] = 29330 >> 8;  // 900 C
  system->shots.push_back({1, 0, bytes, 0});
  bytes[2] = bytes[3] = 0xff;
  system->shots.push_back({2, 0, bytes, 0});
  const Delivery first = deliver(source);
  ASSERT_EQ(first.kind, Kind::frame);
  EXPECT_EQ(first.frame.kelvin_per_count, 0.04);
  EXPECT_NEAR(first.frame.pixels.at<std::uint16_t>(0, 0) * 0.04, 1173.2, 1e-6);
  Delivery second = deliver(source), word = deliver(source);
  if (second.kind == Kind::event) std::swap(second, word);
  ASSERT_EQ(second.kind, Kind::frame);
  EXPECT_EQ(second.frame.pixels.at<std::uint16_t>(0, 1), 0);
  EXPECT_EQ(word.reason, "clipped");
  EXPECT_NE(word.detail.find("1 samples"), std::string::npos) << word.detail;
}

TEST_F(V4l2SourceTest, AScaleThatNoCameraHasIsRefused) {
  for (const double scale : {-0.01, 11.0, std::nan(""), 1e300}) {
    options.kelvin_per_dn = scale;
    EXPECT_FALSE(options.validate()) << scale;
  }
}

}  // namespace
}  // namespace orbitfuse::v4l2
