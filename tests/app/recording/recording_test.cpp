// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/recording.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "app/recording/rehearsal.hpp"
#include "capture/recording/thermal_samples.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "core/image/thermal_counts.hpp"
#include "core/system/utc_now.hpp"
#include "drivers/stills/watch_source.hpp"
#include "tests/capture/scripted_source.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::recording {
namespace {

using test::ScriptedSource;

std::vector<std::unique_ptr<FrameSource>> one_camera(std::uint64_t first, std::uint64_t count,
                                                     const char* id = "thermal0") {
  std::deque<Delivery> script;
  for (std::uint64_t i = 0; i < count; ++i)
    script.push_back(test::frame_delivery(first + i, test::thermal_pixels()));
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(std::make_unique<ScriptedSource>(id, Modality::thermal, std::move(script)));
  return sources;
}

Result<Ending> record(std::vector<std::unique_ptr<FrameSource>> sources,
                      const RecordingOptions& options) {
  Recording recording(std::move(sources), options);
  ORBITFUSE_TRY(recording.prepare());
  return recording.run(nullptr);
}

TEST(Recording, ResumeGoesOnWithTheIdsOfTheSameCamera) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  ASSERT_TRUE(record(one_camera(7, 5), options));
  options.resume = true;
  ASSERT_TRUE(record(one_camera(0, 4), options));
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_TRUE(session->complete);
  ASSERT_EQ(session->frames.size(), 9u);
  EXPECT_EQ(session->devices.size(), 1u);
  ASSERT_EQ(session->streams.size(), 2u);
  EXPECT_EQ(session->streams[0].last_sequence, 11u);
  EXPECT_EQ(session->streams[1].first_sequence, 12u);
  for (const StreamRecord& s : session->streams)
    EXPECT_EQ(s.received + s.lost, s.last_sequence - s.first_sequence + 1);
}

/// A thermal camera of which sample s is s / 50 K.
class HotCamera final : public ScriptedSource {
 public:
  explicit HotCamera(const std::vector<double>& spots_k)
      : ScriptedSource("thermal0", Modality::thermal, script_of(spots_k)) {
    std::vector<double> table(65536);
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = 0.02 * static_cast<double>(i);
    samples_ = ThermalSamples::table(std::move(table));
  }
  Result<Delivery> next(std::chrono::milliseconds timeout) override {
    Result<Delivery> delivery = ScriptedSource::next(timeout);
    if (delivery && delivery->kind == Delivery::Kind::frame) samples_.apply(delivery->frame, 65535);
    return delivery;
  }
  void store_no_finer_than(double kelvin_per_count) override {
    samples_.store_no_finer_than(kelvin_per_count);
  }

 private:
  static std::deque<Delivery> script_of(const std::vector<double>& spots_k) {
    std::deque<Delivery> script;
    for (const double kelvin : spots_k) {
      cv::Mat image(24, 32, CV_16UC1, cv::Scalar(50 * 300));
      image.at<std::uint16_t>(3, 4) = static_cast<std::uint16_t>(std::lround(50 * kelvin));
      script.push_back(test::frame_delivery(script.size(), image));
    }
    return script;
  }
  ThermalSamples samples_ = ThermalSamples::linear(0.01);
};

TEST(Recording, FramesAcrossTheEndOfAScaleKeepTheirTemperaturesAndDoNotGoBack) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  const std::vector<std::vector<double>> recordings{{640, 700, 640, 1100, 300}, {300, 640}};
  std::vector<double> spots_k;
  for (const auto& spots : recordings) {
    std::vector<std::unique_ptr<FrameSource>> sources;
    sources.push_back(std::make_unique<HotCamera>(spots));
    const auto ending = record(std::move(sources), options);
    ASSERT_TRUE(ending) << ending.error().message();
    options.resume = true;
    spots_k.insert(spots_k.end(), spots.begin(), spots.end());
  }
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  ASSERT_EQ(session->frames.size(), spots_k.size());
  for (std::size_t i = 0; i < spots_k.size(); ++i) {
    const auto counts = read_thermal_counts(session->path_of(session->frames[i]));
    ASSERT_TRUE(counts) << counts.error().message();
    EXPECT_EQ(counts->scale.scale, i == 0 ? 0.01 : 0.02) << i;
    const cv::Mat kelvin = *read_thermal_k(session->path_of(session->frames[i]));
    EXPECT_NEAR(kelvin.at<float>(3, 4), spots_k[i], 0.0101) << i;
    EXPECT_NEAR(kelvin.at<float>(0, 0), 300, 0.0101) << i;
  }
  std::vector<std::string> told;
  for (const EventRecord& event : session->events)
    if (event.kind == "scale") told.push_back(event.detail);
  ASSERT_EQ(told.size(), 1u);  // not again by the resumed recording
  EXPECT_EQ(told[0],
            "from thermal/000001.tiff on thermal files hold 0.02 K a count (before: 0.01): up to "
            "1038 C");
}

/// A camera that answers, but only after a while.
class SlowToOpen final : public ScriptedSource {
 public:
  using ScriptedSource::ScriptedSource;
  Status start() override {
    opening = true;
    std::this_thread::sleep_for(std::chrono::seconds(3));
    return ScriptedSource::start();
  }
  static inline std::atomic<bool> opening = false;
};

TEST(Recording, ACameraThatIsBeingOpenedIsNotWaitedForWhenItIsStopped) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(
      std::make_unique<SlowToOpen>("thermal0", Modality::thermal, std::deque<Delivery>{}));
  std::atomic<bool> cancel = false;
  const std::jthread ctrl_c([&] {
    while (!SlowToOpen::opening) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    cancel = true;
  });
  const auto before = std::chrono::steady_clock::now();
  {
    Recording recording(std::move(sources), options);
    const Status prepared = recording.prepare(&cancel);
    ASSERT_FALSE(prepared);
    EXPECT_EQ(prepared.error().kind, ErrorKind::cancelled);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(2));
  EXPECT_FALSE(std::filesystem::exists(folder / "s"));
  std::this_thread::sleep_for(std::chrono::seconds(3));  // its thread ends before the test's heap
}

/// Frames with ids below 110 are from right after its start, the others from much later.
class QueueingSource final : public ScriptedSource {
 public:
  using ScriptedSource::ScriptedSource;
  Status start() override {
    started_ns_ = utc_now_ns();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return {};
  }
  Result<Delivery> next(std::chrono::milliseconds timeout) override {
    Result<Delivery> delivery = ScriptedSource::next(timeout);
    const std::int64_t after_ns = delivery->frame.id < 110 ? 1'000'000 : 3'600'000'000'000;
    delivery->frame.host_time_ns = started_ns_ + after_ns;
    return delivery;
  }

 private:
  std::int64_t started_ns_ = 0;
};

/// The first camera fills its queue while the second one starts.
TEST(Recording, FramesFromBeforeAllCamerasRanAreLeftOut) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  options.live = true;
  std::deque<Delivery> script;
  const auto frame = [&](std::uint64_t id) {
    script.push_back(test::frame_delivery(id, test::thermal_pixels()));
  };
  for (std::uint64_t id = 100; id < 105; ++id) frame(id);
  script.push_back(test::rejected_delivery(105, "short"));
  script.push_back(event_delivery(EventKind::nuc, ""));
  frame(107);
  frame(110);  // from here on all run; 108 and 109 never came
  script.push_back(test::rejected_delivery(111, "short"));
  frame(114);
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(
      std::make_unique<QueueingSource>("thermal0", Modality::thermal, std::move(script)));
  sources.push_back(std::move(one_camera(0, 2, "thermal1")[0]));  // times from long ago: a replay
  ASSERT_TRUE(record(std::move(sources), options));
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_EQ(session->frames.size(), 2u + 2u);
  ASSERT_EQ(session->streams.size(), 2u);
  for (const StreamRecord& s : session->streams) {
    EXPECT_EQ(s.received + s.lost, s.last_sequence - s.first_sequence + 1);
    EXPECT_EQ(s.received, 2u);
    if (s.device != "thermal0") continue;
    EXPECT_EQ(s.first_sequence, 110u);
    EXPECT_EQ(s.lost, 3u);
  }
  std::map<std::string, std::string> events;
  for (const EventRecord& e : session->events) events[e.kind] = e.detail;
  EXPECT_EQ(events["stale"], "7 frames from before all cameras ran were left out");
  EXPECT_TRUE(events.count("nuc"));
}

TEST(Recording, ResumedPhotosAreOneDeviceAndComeOnce) {
  const test::TempFolder folder;
  const auto put_photo = [&](int number) {
    cv::Mat image(30, 40, CV_8UC3);
    cv::RNG random(static_cast<std::uint64_t>(number));
    random.fill(image, cv::RNG::UNIFORM, 0, 255);
    test::put(folder / ("photos/IMG_" + std::to_string(number) + ".jpg"), *encode_jpeg(image, 90));
  };
  RecordingOptions options;
  options.session = folder / "s";
  options.live = true;
  options.seconds = 1.5;
  const auto watch = [&] {
    WatchOptions stills;
    stills.folder = folder / "photos";
    stills.existing = true;
    stills.settle = std::chrono::milliseconds(50);
    std::vector<std::unique_ptr<FrameSource>> sources;
    sources.push_back(std::make_unique<WatchSource>(stills));
    return record(std::move(sources), options);
  };
  put_photo(1);
  put_photo(2);
  ASSERT_TRUE(watch());
  put_photo(3);
  options.resume = true;
  ASSERT_TRUE(watch());
  const Session session = *open_session(folder / "s");
  EXPECT_EQ(session.devices.size(), 1u);
  ASSERT_EQ(session.frames.size(), 3u);
  EXPECT_EQ(session.frames[2].sequence, 2u);
  EXPECT_NE(session.frames[2].source.find("IMG_3"), std::string::npos);
}

TEST(Recording, AnotherCameraGetsItsOwnName) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  ASSERT_TRUE(record(one_camera(0, 2), options));
  options.resume = true;
  auto other =
      std::make_unique<ScriptedSource>("thermal0", Modality::visible, std::deque<Delivery>{});
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(std::move(other));
  ASSERT_TRUE(record(std::move(sources), options));
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session);
  ASSERT_EQ(session->devices.size(), 2u);
  EXPECT_EQ(session->devices[1].id, "visible0");
}

TEST(Recording, CameraThatDoesNotStartLeavesNoFolder) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  auto sources = one_camera(0, 2);
  static_cast<ScriptedSource&>(*sources[0]).fail_start = true;
  const auto ending = record(std::move(sources), options);
  ASSERT_FALSE(ending);
  EXPECT_EQ(ending.error().kind, ErrorKind::device);
  EXPECT_FALSE(std::filesystem::exists(folder / "s"));
}

TEST(Recording, CameraThatFailsLaterLeavesAnIncompleteSessionWithItsAccount) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  auto sources = one_camera(0, 3);
  static_cast<ScriptedSource&>(*sources[0]).fail_at_end = true;
  EXPECT_FALSE(record(std::move(sources), options));
  const auto session = open_session(folder / "s");
  ASSERT_TRUE(session);
  EXPECT_FALSE(session->complete);
  EXPECT_EQ(session->frames.size(), 3u);
  EXPECT_EQ(session->streams.size(), 1u);
}

TEST(Recording, StopsByItself) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  options.live = true;
  options.seconds = 1;  // a busy machine has no frame in a fifth
  auto sources = one_camera(0, 100000);
  static_cast<ScriptedSource&>(*sources[0]).pause = std::chrono::milliseconds(5);
  const auto ending = record(std::move(sources), options);
  ASSERT_TRUE(ending) << ending.error().message();
  EXPECT_EQ(*ending, Ending::time_over);
  EXPECT_TRUE(open_session(folder / "s")->complete);
}

TEST(Recording, FramesForTheGuideToChooseAreTrackingFrames) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  options.choose_stations = true;
  options.guide = LiveGuideOptions{};
  ASSERT_TRUE(record(one_camera(0, 2), options));
  const Session session = *open_session(folder / "s");
  for (const FrameRecord& frame : session.frames) EXPECT_TRUE(frame.tracking);
}

/// Shows pictures while nothing is recorded; then records from the moment of the start on.
class LiveCameraSource final : public ScriptedSource {
 public:
  LiveCameraSource() : ScriptedSource("thermal0", Modality::thermal, {}) {}
  Result<Delivery> next(std::chrono::milliseconds timeout) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(timeout.count() > 0 ? 5 : 0));
    if (timeout.count() == 0) return Delivery{};
    Delivery delivery = test::frame_delivery(next_id_++, test::thermal_pixels());
    delivery.frame.host_time_ns = utc_now_ns();
    return delivery;
  }

 private:
  std::uint64_t next_id_ = 0;
};

TEST(Recording, PicturesAreShownBeforeTheStartAndNothingIsRecorded) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  options.live = true;
  options.seconds = 0.2;
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(std::make_unique<LiveCameraSource>());
  Recording recording(std::move(sources), options);
  ASSERT_TRUE(
      recording.show_until([&] { return recording.latest(Modality::thermal).has_value(); }));
  EXPECT_FALSE(recording.latest(Modality::thermal)->pixels.empty());
  EXPECT_FALSE(recording.latest(Modality::visible));
  EXPECT_FALSE(recording.operator_at_station());  // nothing is being recorded
  EXPECT_FALSE(std::filesystem::exists(folder / "s"));
  ASSERT_TRUE(recording.prepare());
  const auto ending = recording.run(nullptr);
  ASSERT_TRUE(ending) << ending.error().message();
  const Session session = *open_session(folder / "s");
  EXPECT_TRUE(session.complete);
  ASSERT_EQ(session.streams.size(), 1u);
  // On a slow disk frames are dropped; none is missing between those shown and those recorded.
  for (const GapRecord& gap : session.gaps)
    EXPECT_TRUE(gap.reason.starts_with("dropped")) << gap.reason;
  EXPECT_GT(session.streams[0].first_sequence, 0u);
}

/// On the page of a replay, as Ctrl-C at the terminal.
TEST(Recording, AStopCutsAReplayShortAndTheSessionSaysSo) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  for (const bool live : {false, true}) {
    options.session = folder / (live ? "live" : "replay");
    options.live = live;
    std::vector<std::unique_ptr<FrameSource>> sources;
    sources.push_back(std::make_unique<LiveCameraSource>());
    Recording recording(std::move(sources), options);
    ASSERT_TRUE(recording.prepare());
    const auto ending = recording.run(nullptr, [&] {
      if (recording.latest(Modality::thermal)) (void)recording.request_stop();
    });
    EXPECT_EQ(ending.has_value(), live);
    if (!ending) {
      EXPECT_EQ(ending.error().kind, ErrorKind::cancelled) << ending.error().message();
    }
    EXPECT_EQ(open_session(options.session)->complete, live);
  }
}

TEST(Recording, ACorrectionThatNoCameraHasIsRefusedWithTheReason) {
  const test::TempFolder folder;
  RecordingOptions options;
  options.session = folder / "s";
  options.live = true;
  options.seconds = 0.3;
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(std::make_unique<LiveCameraSource>());
  Recording recording(std::move(sources), options);
  ASSERT_TRUE(recording.prepare());
  std::string told;
  ASSERT_TRUE(recording.run(nullptr, [&] {
    if (const auto asked = recording.request_correction(); !asked && told.empty())
      told = asked.error().message();
  }));
  EXPECT_NE(told.find("has no shutter correction"), std::string::npos) << told;
}

TEST(Rehearsal, CountsAndWritesNothing) {
  auto sources = one_camera(0, 3);
  std::deque<Delivery> script;
  script.push_back(test::frame_delivery(10, test::thermal_pixels()));
  script.push_back(test::rejected_delivery(14, "short"));
  sources.push_back(
      std::make_unique<ScriptedSource>("thermal1", Modality::thermal, std::move(script)));
  const auto list = rehearse(sources, 5);
  ASSERT_TRUE(list) << list.error().message();
  EXPECT_EQ((*list)[0].frames, 3u);
  EXPECT_EQ((*list)[0].width, 32);
  EXPECT_EQ((*list)[1].missing, 3u);
  EXPECT_EQ((*list)[1].rejected, 1u);
  EXPECT_EQ((*list)[1].reasons.at("short"), 1);
  EXPECT_EQ(static_cast<ScriptedSource&>(*sources[0]).stops, 1);
}

}  // namespace
}  // namespace orbitfuse::recording
