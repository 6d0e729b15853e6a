// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <thread>

#include "drivers/aravis/gvcp_probe.hpp"
#include "tests/drivers/aravis/stream_harness.hpp"
#include "tests/support/gev_genicam_xml.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::aravis {
namespace {

using namespace std::chrono_literals;
using orbitfuse::testing::GevFaults;
using orbitfuse::testing::GevOptions;
using orbitfuse::testing::GevSimulator;
namespace registers = orbitfuse::testing::gev_registers;

class AravisStream : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!camera.start_when_free()) GTEST_SKIP() << "the GVCP port 3956 on loopback is in use";
    options.camera = "127.0.0.1";
    options.profiles = std::filesystem::path(ORBITFUSE_SOURCE_DIR) / "config/cameras";
    options.buffers = 240;  // 4 s: a busy host that runs other tests loses no frame of its own
  }
  static GevOptions small() {
    GevOptions o;
    o.width = 160;
    o.height = 120;
    o.rate_hz = 60;
    return o;
  }
  static auto frames(std::uint64_t n) {
    return [n](const Tally& t) { return t.frames + t.rejected >= n; };
  }

  GevSimulator camera{small()};
  AravisOptions options;
};

TEST_F(AravisStream, CleanStreamIsBitExactAcrossTheIdWrap) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(source.describe().serial, "SIM0001");
  EXPECT_EQ(camera.register_value(registers::ir_format),
            2u);                                        // TemperatureLinear10mK, by the profile
  const Tally tally = drain(source, 20s, frames(200));  // ids 65400 .. 65535, 1 ..
  EXPECT_EQ(tally.frames, 200u);
  EXPECT_EQ(tally.rejected + tally.wrong_bits + tally.not_rising, 0u);
  EXPECT_EQ(tally.span(), 200u);
  EXPECT_NEAR(tally.rate_hz(), 60, 0.6);  // by the camera's stamps
  EXPECT_EQ(source.clock().jumps(), 0);
}

TEST_F(AravisStream, LostPacketsAreResentBitExact) {
  GevFaults faults;
  faults.packet_loss = 0.01;
  faults.reorder = 0.01;
  faults.duplicate = 0.01;
  camera.set_faults(faults);
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const Tally tally = drain(source, 20s, frames(200));
  EXPECT_GT(camera.packets_dropped(), 20u);
  EXPECT_EQ(tally.frames, 200u);
  EXPECT_EQ(tally.rejected + tally.wrong_bits + tally.not_rising, 0u);
}

TEST_F(AravisStream, WithoutResendEveryBadFrameIsCountedNoneIsGood) {
  GevFaults faults;
  faults.packet_loss = 0.01;
  faults.answer_resend = false;
  camera.set_faults(faults);
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const Tally tally = drain(source, 20s, frames(120));
  // Aravis' own count of missing packets is far off: it is not passed on.
  EXPECT_EQ(source.transport_report().find("missing"), std::string::npos);
  EXPECT_GT(tally.span(), tally.frames);
  EXPECT_EQ(tally.wrong_bits + tally.not_rising, 0u);
}

TEST_F(AravisStream, WrongFramesMidStreamAreAllRejected) {
  for (int kind = 0; kind < 4; ++kind) {
    SCOPED_TRACE(kind);
    camera.kill();
    ASSERT_TRUE(camera.start());
    GevFaults faults;
    if (kind == 0) faults.short_frame_every = 5;
    if (kind == 1) faults.wrong_size_every = 5;
    if (kind == 2) faults.too_large_every = 5;
    if (kind == 3) faults.wrong_format_every = 5;
    faults.answer_resend = false;
    camera.set_faults(faults);
    AravisSource source(options);
    ASSERT_TRUE(source.start());
    const Tally tally = drain(source, 15s, frames(60));
    EXPECT_EQ(tally.wrong_bits, 0u);
    // Each fifth by the simulator's number, and no other.
    const std::uint64_t bad = tally.span() - tally.frames;
    EXPECT_GE(bad, 10u);
    ASSERT_TRUE(tally.shift);
    std::uint64_t expected = 0;
    for (std::uint64_t id = tally.first_id; id <= tally.last_id; ++id)
      expected += (id + *tally.shift) % 4001 % 5 == 4;
    EXPECT_EQ(bad, expected);
  }
  camera.set_faults({});
}

TEST_F(AravisStream, KilledCameraIsToldAndComesBackWithItsSettings) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const Tally before = drain(source, 10s, frames(20));
  camera.kill();
  const auto killed = testing_clock::now();
  const Tally silent =
      drain(source, 5s, [](const Tally& t) { return t.has("silent") || t.has("disconnected"); });
  EXPECT_FALSE(silent.events.empty());
  EXPECT_LT(testing_clock::now() - killed, 2s);  // generous: the bench measures the 0.5 s bar
  drain(source, 2s);
  ASSERT_TRUE(camera.start());
  const Tally back = drain(source, 20s, frames(20));
  EXPECT_TRUE(back.has("reconnected"));
  EXPECT_EQ(back.frames, 20u);
  // Two seconds and more at 60 Hz are a gap in the ids, and no more than the outage lasted.
  const double outage_s = std::chrono::duration<double>(testing_clock::now() - killed).count();
  EXPECT_GT(back.first_id, before.last_id + 60);
  EXPECT_LT(static_cast<double>(back.first_id - before.last_id), 90 * outage_s);
  EXPECT_EQ(back.wrong_bits + back.not_rising, 0u);
  EXPECT_EQ(camera.register_value(registers::ir_format), 2u);
}

TEST_F(AravisStream, LinkDownAndBack) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(20));
  GevFaults faults;
  faults.link_down = true;
  camera.set_faults(faults);
  const Tally down = drain(source, 3s);
  EXPECT_TRUE(down.has("silent"));
  EXPECT_TRUE(down.has("disconnected"));
  camera.set_faults({});
  const Tally back = drain(source, 20s, frames(20));
  EXPECT_TRUE(back.has("reconnected"));
  EXPECT_EQ(back.wrong_bits + back.not_rising, 0u);
}

TEST_F(AravisStream, TwoOutagesWithoutAFrameBetweenCostTheTimeOfBoth) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const Tally before = drain(source, 10s, frames(60));
  const auto lost = testing_clock::now();
  const auto disconnected = [](const Tally& t) { return t.has("disconnected"); };
  const auto reconnected = [](const Tally& t) { return t.has("reconnected"); };
  GevFaults faults;
  faults.link_down = true;
  camera.set_faults(faults);
  ASSERT_TRUE(disconnected(drain(source, 10s, disconnected)));
  drain(source, 1s);
  faults = {};
  faults.packet_loss = 1;  // it answers, but sends nothing
  faults.answer_resend = false;
  camera.set_faults(faults);
  const Tally between = drain(source, 2500ms);
  EXPECT_FALSE(reconnected(between));
  EXPECT_EQ(between.frames + between.rejected, 0u);
  camera.set_faults({});
  const Tally back = drain(source, 20s, [](const Tally& t) { return t.frames > 0; });
  ASSERT_TRUE(reconnected(back));
  const double both_s = std::chrono::duration<double>(testing_clock::now() - lost).count();
  const auto gap = static_cast<double>(back.first_id - before.last_id);
  // A camera that counted on says exactly what it took meanwhile, which may be less.
  if (back.shift && back.shift == before.shift) return;
  EXPECT_GT(gap, 0.75 * 60 * both_s);  // either alone is under two thirds
  EXPECT_LT(gap, 1.5 * 60 * both_s);
}

/// Three quarters of the frames are damaged: they are frames of the camera's rate all the same.
TEST_F(AravisStream, AnOutageOfALossyLinkCostsItsTime) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  GevFaults lossy;
  lossy.packet_loss = 0.05;
  lossy.answer_resend = false;
  camera.set_faults(lossy);
  const Tally before = drain(source, 20s, frames(120));
  EXPECT_GT(before.rejected, before.frames);
  EXPECT_FALSE(before.has("silent"));
  GevFaults down;
  down.link_down = true;
  camera.set_faults(down);
  const auto lost = testing_clock::now();
  const auto disconnected = [](const Tally& t) { return t.has("disconnected"); };
  const Tally ending = drain(source, 10s, disconnected);
  const std::uint64_t last = std::max(before.last_id, ending.last_id);
  ASSERT_TRUE(disconnected(ending));
  camera.set_faults({});
  const Tally back = drain(source, 20s, [](const Tally& t) { return t.frames > 0; });
  const double outage_s = std::chrono::duration<double>(testing_clock::now() - lost).count();
  const auto gap = static_cast<double>(back.first_id - last);
  EXPECT_GT(gap, 0.6 * 60 * outage_s);
  EXPECT_LT(gap, 1.4 * 60 * outage_s);
}

TEST_F(AravisStream, ComesBackWithTheSizeItHad) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(20));
  camera.kill();
  GevOptions other = small();
  other.width = 320;
  GevSimulator again(other);
  ASSERT_TRUE(again.start_when_free());
  const Tally back = drain(source, 20s, frames(20));
  EXPECT_TRUE(back.has("reconnected"));
  EXPECT_EQ(back.frames, 20u);
  EXPECT_EQ(back.wrong_bits, 0u);
  EXPECT_EQ(again.register_value(registers::width), 160u);
}

TEST_F(AravisStream, AnotherCameraAtItsAddressIsNotTakenForIt) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(20));
  camera.kill();
  GevOptions other = small();
  other.serial = "SIM0002";
  GevSimulator another(other);
  ASSERT_TRUE(another.start_when_free());
  const Tally refused = drain(source, 20s, [](const Tally& t) { return t.has("reopen-failed"); });
  EXPECT_TRUE(refused.has("reopen-failed"));
  EXPECT_FALSE(refused.has("reconnected"));
  EXPECT_EQ(source.describe().serial, "SIM0001");
}

TEST_F(AravisStream, FrameNumbersThatStartAgainAreALostStreamNotAFloodOfDuplicates) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(200));  // past the wrap: ids from 1 are the past
  camera.restart_ids();
  const Tally tally =
      drain(source, 20s, [](const Tally& t) { return t.has("reconnected") && t.frames > 20; });
  EXPECT_TRUE(tally.has("disconnected"));
  EXPECT_LE(tally.times("repeated-id"), 3);
  EXPECT_TRUE(tally.has("reconnected"));
  EXPECT_EQ(tally.not_rising, 0u);
}

TEST_F(AravisStream, CorrectionOfAMuteCameraDoesNotHoldUpItsStream) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(20));
  GevFaults mute;
  mute.mute_control = true;
  camera.set_faults(mute);
  const Tally told = drain(source, 10s, [](const Tally& t) { return t.has("control-silent"); });
  ASSERT_TRUE(told.has("control-silent"));
  source.request_correction();
  const Tally after =
      drain(source, 10s, [](const Tally& t) { return t.has("nuc-failed") && t.frames >= 10; });
  EXPECT_TRUE(after.has("nuc-failed"));
  EXPECT_EQ(after.span(), after.frames);  // waiting for its answer would cost frames
  EXPECT_FALSE(after.has("disconnected"));
}

TEST_F(AravisStream, MutedControlChannelIsToldAndRecovered) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(20));
  GevFaults faults;
  faults.mute_control = true;  // the stream runs on until the camera's heartbeat times out
  camera.set_faults(faults);
  const Tally mute = drain(source, 15s, [](const Tally& t) { return t.has("disconnected"); });
  ASSERT_TRUE(mute.has("disconnected"));
  EXPECT_EQ(mute.events.front(), "control-silent");  // long before the stream ends
  EXPECT_GT(mute.frames, 20u);
  camera.set_faults({});
  const Tally back = drain(source, 20s, frames(20));
  EXPECT_TRUE(back.has("reconnected"));
  EXPECT_EQ(back.wrong_bits + back.not_rising, 0u);
}

TEST_F(AravisStream, ClockStepIsReportedAndHostTimeRises) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(60));
  camera.step_clock(-7);
  const Tally tally =
      drain(source, 20s, [](const Tally& t) { return t.has("clock") && t.frames > 30; });
  EXPECT_TRUE(tally.has("clock"));
  EXPECT_EQ(tally.not_rising, 0u);
}

TEST_F(AravisStream, SecondControllerIsRefusedWithAReason) {
  AravisSource first(options), second(options);
  ASSERT_TRUE(first.start());
  const Status status = second.start();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_NE(status.error().message().find("another program"), std::string::npos)
      << status.error().message();
  EXPECT_EQ(drain(first, 10s, frames(20)).frames, 20u);
}

TEST_F(AravisStream, NucIsCommandedAndFramesAreFlagged) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(5));
  ASSERT_TRUE(source.correct_nonuniformity());
  EXPECT_EQ(camera.nuc_count(), 1);
  const Result<Delivery> delivery = source.next(500ms);
  ASSERT_TRUE(delivery);
  ASSERT_EQ(delivery->kind, Delivery::Kind::frame);
  EXPECT_EQ(delivery->frame.flags, std::vector<std::string>{"nuc"});
}

TEST_F(AravisStream, NucAskedForFromAnotherThreadIsToldAndCountersAreReported) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(5));
  std::thread([&] { source.request_correction(); }).join();
  const Tally tally = drain(source, 5s, [](const Tally& t) { return t.has("nuc"); });
  EXPECT_TRUE(tally.has("nuc"));
  EXPECT_EQ(camera.nuc_count(), 1);
  drain(source, 10s, frames(10));
  const auto completed = source.statistics().completed;
  EXPECT_GE(completed, 15u);
  EXPECT_NE(source.transport_report().find(fmt::format("{} buffers completed", completed)),
            std::string::npos);
}

/// What a camera with one spot of this sample delivers first, and the words about clipping.
struct SpotSeen {
  std::optional<Frame> frame;
  std::string clipped;
};

class AravisHot : public AravisStream {
 protected:
  SpotSeen see(std::uint16_t spot, const std::string& profile) {
    camera.kill();
    GevOptions o = small();
    o.spot = spot;
    o.planck_j1 = 10;
    GevSimulator hot(o);
    SpotSeen seen;
    if (!hot.start_when_free()) return seen;
    options.profile = profile;
    AravisSource source(options);
    const Status status = source.start();
    EXPECT_TRUE(status) << status.error().message();
    const auto end = testing_clock::now() + 10s;
    while (status && testing_clock::now() < end) {
      const Result<Delivery> delivery = source.next(200ms);
      if (!delivery) break;
      if (delivery->kind == Delivery::Kind::event && delivery->event == EventKind::clipped)
        seen.clipped = delivery->detail;
      if (delivery->kind != Delivery::Kind::frame) continue;
      if (seen.frame) break;
      seen.frame = delivery->frame;
    }
    return seen;
  }
  static double spot_k(const Frame& frame) {
    return frame.pixels.at<std::uint16_t>(0, 0) * frame.kelvin_per_count;
  }
};

TEST_F(AravisHot, NineHundredDegreesKeepTheirTemperature) {
  const SpotSeen seen = see(11732, "flir-a50-a70-hot");
  ASSERT_TRUE(seen.frame);
  EXPECT_NEAR(spot_k(*seen.frame), 1173.2, 1e-6);
  EXPECT_EQ(seen.frame->kelvin_per_count, 0.1);
  EXPECT_EQ(seen.clipped, "");
  EXPECT_TRUE(seen.frame->flags.empty());
}

TEST_F(AravisHot, RadiometricSamplesTakeTheScaleThatHoldsThem) {
  const SpotSeen seen = see(65000, "flir-radiometric");
  ASSERT_TRUE(seen.frame);
  const auto signal = [](double kelvin) { return 16000 / (std::exp(1430 / kelvin) - 1); };
  EXPECT_NEAR(100 + 10 * (0.95 * signal(spot_k(*seen.frame)) + 0.05 * signal(293.15)), 65000, 2);
  EXPECT_EQ(seen.frame->kelvin_per_count, 0.02);  // 1180 K
  EXPECT_EQ(seen.clipped, "");
}

TEST_F(AravisHot, TheScaleOfAHotFrameStaysWhenTheCameraComesBackCool) {
  camera.kill();
  GevOptions o = small();
  o.planck_j1 = 10;
  GevOptions cool = o;
  cool.planck_j1 = 100;  // every sample below 450 K
  o.spot = 65000;        // 1180 K
  options.profile = "flir-radiometric";
  AravisSource source(options);
  const auto next_frame = [&]() -> std::optional<Frame> {
    const auto end = testing_clock::now() + 20s;
    while (testing_clock::now() < end) {
      const Result<Delivery> delivery = source.next(200ms);
      if (!delivery) break;
      if (delivery->kind == Delivery::Kind::frame) return delivery->frame;
    }
    return std::nullopt;
  };
  {
    GevSimulator hot(o);
    ASSERT_TRUE(hot.start_when_free());
    ASSERT_TRUE(source.start());
    const auto frame = next_frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->kelvin_per_count, 0.02);
    hot.kill();
  }
  while (source.next(200ms)->kind != Delivery::Kind::event) {
  }  // away
  GevSimulator again(cool);
  ASSERT_TRUE(again.start_when_free());
  const auto frame = next_frame();
  ASSERT_TRUE(frame);
  EXPECT_LT(spot_k(*frame), 655);
  EXPECT_GT(spot_k(*frame), 200);
  EXPECT_EQ(frame->kelvin_per_count, 0.02);
}

TEST_F(AravisHot, ASampleAtTheEndOfTheScaleIsADeadPixelAndTold) {
  const SpotSeen seen = see(65535, "flir-a50-a70");
  ASSERT_TRUE(seen.frame);
  EXPECT_EQ(spot_k(*seen.frame), 0);
  EXPECT_NE(seen.clipped.find("382 C or hotter"), std::string::npos) << seen.clipped;
  EXPECT_EQ(seen.frame->flags, std::vector<std::string>{"clipped"});
  EXPECT_NEAR(seen.frame->pixels.at<std::uint16_t>(0, 1) * seen.frame->kelvin_per_count, 300, 21);
}

TEST_F(AravisStream, UnknownFeatureInTheProfileIsNamed) {
  const test::TempFolder folder;
  test::put(
      folder / "mine.toml",
      "name = \"mine\"\nmodels = []\nsettings = [{PixelFormat = \"Mono16\"}, {NoSuchThing = 3}]\n");
  options.profiles = folder.path();
  options.profile = "mine";
  AravisSource source(options);
  const Status status = source.start();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::usage);
  EXPECT_NE(status.error().where.find("NoSuchThing"), std::string::npos)
      << status.error().message();
}

TEST_F(AravisStream, RegistersAreReadWithoutControl) {
  EXPECT_EQ(read_register("127.0.0.1", GvcpRegister::control_privilege, 500ms), 0u);
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  EXPECT_NE(read_register("127.0.0.1", GvcpRegister::control_privilege, 500ms).value_or(0), 0u);
  EXPECT_GT(read_register("127.0.0.1", GvcpRegister::packet_size, 500ms).value_or(0) & 0xffff,
            500u);
  EXPECT_FALSE(read_register("127.0.0.99", GvcpRegister::packet_size, 50ms));
  EXPECT_FALSE(read_register("no address", GvcpRegister::packet_size, 50ms));
}

TEST_F(AravisStream, DiscoveryFindsItAndItsSerialOpensIt) {
  const std::vector<FoundCamera> found = discover();
  const auto ours = std::find_if(found.begin(), found.end(),
                                 [](const FoundCamera& c) { return c.serial == "SIM0001"; });
  ASSERT_NE(ours, found.end()) << found.size() << " others";
  EXPECT_EQ(ours->address, "127.0.0.1");
  EXPECT_NE(ours->model.find("A70"), std::string::npos);
  options.camera = ours->id;
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(drain(source, 10s, frames(10)).frames, 10u);
}

/// Obeys whoever writes, also the connection that was given up.
class AravisUnguarded : public AravisStream {
 protected:
  static GevOptions unguarded() {
    GevOptions o = small();
    o.enforce_control = false;
    return o;
  }
  void SetUp() override {
    if (!camera_of_all.start_when_free()) GTEST_SKIP() << "the GVCP port 3956 is in use";
    options.camera = "127.0.0.1";
    options.profiles = std::filesystem::path(ORBITFUSE_SOURCE_DIR) / "config/cameras";
  }
  /// Streams, lets the camera be away with `fault`, and sees it come back.
  void expect_one_reconnection(const GevFaults& fault, std::chrono::milliseconds away) {
    AravisSource source(options);
    ASSERT_TRUE(source.start());
    const Tally before = drain(source, 10s, frames(60));
    ASSERT_TRUE(before.shift);
    camera_of_all.set_faults(fault);
    const Tally during = drain(source, away);
    camera_of_all.set_faults({});
    // Long enough for a second reconnection, had the first one been killed.
    const Tally after = drain(source, 6s);
    EXPECT_EQ(during.times("reconnected") + after.times("reconnected"), 1);
    EXPECT_GT(after.frames, 120u);
    EXPECT_EQ(after.wrong_bits + after.not_rising, 0u);
    // Each id is the camera's own count still: what was skipped was lost, and nothing else.
    EXPECT_EQ(after.shift, before.shift) << (after.details.empty() ? "" : after.details.front());
  }

  GevSimulator camera_of_all{unguarded()};
};

TEST_F(AravisUnguarded, FrozenForThreeSecondsItComesBackOnce) {
  GevFaults fault;
  fault.freeze = true;
  expect_one_reconnection(fault, 3s);
}

TEST_F(AravisUnguarded, AStallOfItsStreamIsOneReconnection) {
  GevFaults fault;
  fault.stall = true;
  expect_one_reconnection(fault, 1500ms);
}

/// A busy host, or a camera that was slow for a while: the last frames tell its rate badly, and its
/// own count is believed still.
TEST_F(AravisUnguarded, AStallAfterSlowFramesIsCountedByItsNumbers) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(20));
  GevFaults fault;
  fault.slow = 1.6;
  camera_of_all.set_faults(fault);
  const Tally before = drain(source, 10s, frames(30));
  ASSERT_TRUE(before.shift);
  fault = {};
  fault.stall = true;
  camera_of_all.set_faults(fault);
  drain(source, 1500ms);
  camera_of_all.set_faults({});
  const Tally after = drain(source, 6s, frames(30));
  EXPECT_GT(after.frames, 20u);
  EXPECT_EQ(after.shift, before.shift) << (after.details.empty() ? "" : after.details.front());
}

/// Its numbers go on: nothing was lost, and nothing is counted.
TEST_F(AravisUnguarded, APauseWithoutASkippedNumberIsNoLoss) {
  GevFaults fault;
  fault.pause = true;
  expect_one_reconnection(fault, 2s);
}

TEST_F(AravisUnguarded, MuteForEightSecondsItComesBackOnce) {
  GevFaults fault;
  fault.mute_control = true;
  expect_one_reconnection(fault, 8s);
}

TEST_F(AravisUnguarded, RestartedItComesBackOnceAndTheOutageIsCountedByTime) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const Tally before = drain(source, 10s, frames(60));
  const auto gone = testing_clock::now();
  camera_of_all.kill();
  const Tally during = drain(source, 3s);
  ASSERT_TRUE(camera_of_all.start_when_free());
  const Tally first = drain(source, 10s, frames(1));
  const double outage_s = std::chrono::duration<double>(testing_clock::now() - gone).count();
  const Tally after = drain(source, 4s);
  EXPECT_EQ(during.times("reconnected") + first.times("reconnected"), 1);
  EXPECT_EQ(after.times("reconnected") + after.times("disconnected"), 0);
  const std::uint64_t last = std::max(before.last_id, during.last_id);
  EXPECT_NEAR(static_cast<double>(first.first_id - last), 60 * outage_s, 12);
}

/// It answers and can be opened, but no frame ever comes: said so, and tried less often.
TEST_F(AravisStream, ACameraThatNeverSendsIsToldAndLeftInPeace) {
  options.patience = 30s;
  options.most_patience = 30s;
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(30));
  GevFaults fault;
  fault.packet_loss = 1;
  fault.answer_resend = false;
  camera.set_faults(fault);
  const Tally told = drain(source, 20s, [](const Tally& t) { return t.has("reopen-failed"); });
  EXPECT_TRUE(told.has("reopen-failed"));
  EXPECT_FALSE(told.has("reconnected"));
  EXPECT_EQ(told.times("disconnected"), 1);
  camera.set_faults({});
  EXPECT_EQ(drain(source, 2s).frames, 0u);  // its patience is not over
}

TEST_F(AravisStream, AnOutageAtTheEndIsCountedByTimeAndStoppingDoesNotWait) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const Tally before = drain(source, 10s, frames(60));
  camera.kill();
  const auto gone = testing_clock::now();
  const Tally during = drain(source, 3s);
  EXPECT_TRUE(during.has("disconnected"));
  const std::uint64_t last = std::max(before.last_id, during.last_id);
  const std::vector<Delivery> end = source.unfinished();
  const double outage_s = std::chrono::duration<double>(testing_clock::now() - gone).count();
  ASSERT_FALSE(end.empty());
  EXPECT_EQ(end.back().kind, Delivery::Kind::lost);
  EXPECT_NEAR(static_cast<double>(end.back().frame.id - last), 60 * outage_s, 8);
  const auto stopping = testing_clock::now();
  source.stop();
  EXPECT_LT(testing_clock::now() - stopping, 2s);  // the bar; Aravis alone needs 5 s
}

/// Whoever stops it stops it again when it goes: only the first waits for the old connection.
TEST_F(AravisStream, StoppedTwiceASilentCameraIsWaitedForOnce) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  drain(source, 10s, frames(20));
  GevFaults mute;
  mute.mute_control = mute.freeze = true;
  camera.set_faults(mute);
  source.stop();
  const auto again = testing_clock::now();
  source.stop();
  EXPECT_LT(testing_clock::now() - again, 500ms);
}

/// Damaged frames that are still waited for when the recording ends are counted, too.
TEST_F(AravisStream, FramesUnderWayAtTheEndAreInTheCount) {
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  Tally all = drain(source, 10s, frames(60));
  ASSERT_TRUE(all.shift);
  GevFaults lossy;
  lossy.packet_loss = 0.05;  // most frames are damaged
  lossy.answer_resend = false;
  camera.set_faults(lossy);
  const Tally damaged = drain(source, 1s);
  std::uint64_t last = std::max(all.last_id, damaged.last_id);
  for (const Delivery& delivery : source.unfinished()) {
    if (delivery.kind != Delivery::Kind::event) last = std::max(last, delivery.frame.id);
  }
  // The camera was told to stop: all that it sent is known by now.
  const std::uint64_t sent_last = camera.frames_sent() - 1;
  EXPECT_EQ((last + *all.shift) % 4001, sent_last % 4001);
}

TEST_F(AravisStream, ACorrectionThatTheProfileDoesNotKnowIsRefused) {
  options.profile = "generic";
  AravisSource source(options);
  ASSERT_TRUE(source.start());
  const Status status = source.request_correction();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::unavailable);
  EXPECT_NE(status.error().message().find("generic"), std::string::npos);
}

TEST_F(AravisStream, NumbersThatTheCameraRoundsAreTakenAndOthersAreNamed) {
  const test::TempFolder folder;
  const auto settings = [&](const std::string& setting) {
    test::put(folder / "mine.toml",
              "name = \"mine\"\nmodels = []\nsettings = [{" + setting + "}]\n");
  };
  options.profiles = folder.path();
  options.profile = "mine";
  settings("AcquisitionFrameRate = 30.0");  // it makes 30.0003 of it
  {
    AravisSource source(options);
    const Status status = source.start();
    EXPECT_TRUE(status) << status.error().message();
  }
  settings("Width = 161");
  AravisSource source(options);
  camera.set_register_mask(registers::width, ~1u);
  const Status status = source.start();
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().found.find("161"), std::string::npos) << status.error().message();
  EXPECT_NE(status.error().found.find("160"), std::string::npos);
}

TEST(AravisAbsent, NoCameraIsADeviceError) {
  AravisOptions options;
  options.camera = "127.0.0.99";
  AravisSource source(options);
  const Status status = source.start();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
}

}  // namespace
}  // namespace orbitfuse::aravis
