// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/recorder.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>

#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/capture/scripted_source.hpp"
#include "tests/core/session/session_account.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::frame_delivery;
using test::rejected_delivery;
using test::ScriptedSource;
using test::TempFolder;
using test::thermal_pixels;

void expect_exact_accounts(const Session& session) {
  test::expect_each_id_once(session);
  for (const StreamRecord& s : session.streams) {
    EXPECT_EQ(s.received + s.lost, s.last_sequence - s.first_sequence + 1) << s.device;
    std::uint64_t gaps = 0, frames = 0;
    for (const GapRecord& g : session.gaps) gaps += g.device == s.device ? g.count : 0;
    for (const FrameRecord& f : session.frames) frames += f.device == s.device;
    EXPECT_EQ(gaps, s.lost) << s.device;
    EXPECT_EQ(frames, s.received) << s.device;
  }
}

struct Recording {
  TempFolder folder;
  std::unique_ptr<SessionWriter> writer = *SessionWriter::create(folder / "s");
  Session open() const { return *open_session(folder / "s"); }
};

TEST(Recorder, TwoCamerasEveryIdAccountedFor) {
  Recording r;
  std::deque<Delivery> script;
  for (std::uint64_t id : {10, 11, 12, 15, 16})
    script.push_back(frame_delivery(id, thermal_pixels()));
  script.push_back(rejected_delivery(17, "short"));
  script.push_back(rejected_delivery(18, "short"));
  script.push_back(frame_delivery(20, thermal_pixels()));
  script.push_back(frame_delivery(20, thermal_pixels()));        // a duplicate has no place
  script.push_back(frame_delivery(21, cv::Mat(3, 3, CV_8UC3)));  // not a thermal image
  ScriptedSource thermal("thermal0", Modality::thermal, script);
  std::deque<Delivery> photos;
  for (std::uint64_t id = 0; id < 8; ++id)
    photos.push_back(frame_delivery(id, cv::Mat(20, 20, CV_8UC3, cv::Scalar(4, 5, 6))));
  ScriptedSource visible("visible0", Modality::visible, photos);

  RecorderOptions options;
  options.backpressure = Backpressure::wait;
  Recorder recorder(*r.writer, options);
  std::atomic<int> announced{0};
  recorder.on_frame = [&](const StoredFrame&) { ++announced; };
  const Status status = recorder.run({&thermal, &visible});
  ASSERT_TRUE(status) << status.error().message();
  ASSERT_TRUE(r.writer->close());
  const Session session = r.open();
  EXPECT_TRUE(session.complete);
  expect_exact_accounts(session);
  ASSERT_EQ(session.streams.size(), 2u);
  for (const StreamStatus& s : recorder.status()) {
    EXPECT_TRUE(s.ended);
    if (s.device == "thermal0") {
      EXPECT_EQ(s.received, 6u);
      EXPECT_EQ(s.missing, 3u);   // 13, 14, 19
      EXPECT_EQ(s.rejected, 3u);  // 17, 18, 21
      EXPECT_EQ(s.dropped, 0u);
    } else {
      EXPECT_EQ(s.received, 8u);
      EXPECT_EQ(s.lost, 0u);
    }
  }
  EXPECT_EQ(announced, 14);
  ASSERT_EQ(session.events.size(), 1u);
  EXPECT_EQ(session.events[0].kind, "out-of-order");
  EXPECT_EQ(thermal.stops, 1);
  for (const FrameRecord& f : session.frames) {
    ASSERT_TRUE(f.quality);
    EXPECT_EQ(f.quality->sharpness > 0, f.modality == Modality::thermal);  // the photos are blank
  }
}

TEST(Recorder, SlowDiskDropsByPolicyAndCounts) {
  Recording r;
  std::deque<Delivery> script;
  for (std::uint64_t id = 1; id <= 200; ++id)
    script.push_back(frame_delivery(id, thermal_pixels(320, 240)));
  ScriptedSource source("thermal0", Modality::thermal, script);
  RecorderOptions options;
  options.queue_frames = 2;
  Recorder recorder(*r.writer, options);
  recorder.on_frame = [](const StoredFrame&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  ASSERT_TRUE(recorder.run({&source}));
  const Session session = r.open();
  expect_exact_accounts(session);
  const StreamStatus s = recorder.status()[0];
  EXPECT_GT(s.dropped, 0u);
  EXPECT_EQ(s.received + s.dropped, 200u);
  EXPECT_FALSE(session.complete);  // the caller has not closed it
}

/// The writer stands still until the whole script was taken: neither frames nor events wait for it,
/// and both are written in the order in which they came.
TEST(Recorder, EventsDoNotWaitForTheWriterAndKeepTheirPlace) {
  Recording r;
  const Delivery event = event_delivery(EventKind::nuc, "");
  ScriptedSource source("thermal0", Modality::thermal,
                        {frame_delivery(1, thermal_pixels()), frame_delivery(2, thermal_pixels()),
                         event, frame_delivery(3, thermal_pixels()), Delivery{}});
  std::atomic<int> taken{0};
  source.before_next = [&] { ++taken; };
  Recorder recorder(*r.writer, {});
  recorder.on_frame = [&](const StoredFrame&) {
    while (taken < 5) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  ASSERT_TRUE(recorder.run({&source}));
  const std::string manifest = *read_file(r.folder / "s" / "manifest.jsonl");
  const auto place = [&](const char* text) { return manifest.find(text); };
  const std::size_t nuc = place("\"nuc\"");
  ASSERT_NE(nuc, std::string::npos);
  EXPECT_LT(place("\"sequence\":2"), nuc);
  EXPECT_GT(place("\"sequence\":3"), nuc);
  EXPECT_NE(place("\"sequence\":3"), std::string::npos);
}

/// What a kill would leave: each gap is on disk before the frame after it.
TEST(Recorder, WhereverTheManifestEndsItAccountsForEveryIdUpToThere) {
  Recording r;
  std::deque<Delivery> script;
  for (std::uint64_t id : {1, 2, 5, 6}) script.push_back(frame_delivery(id, thermal_pixels()));
  ScriptedSource source("thermal0", Modality::thermal, script);
  Recorder recorder(*r.writer, {});
  int looks = 0;
  recorder.on_frame = [&](const StoredFrame&) {
    ++looks;
    test::expect_each_id_once(*open_session(r.folder / "s"));
  };
  ASSERT_TRUE(recorder.run({&source}));
  EXPECT_EQ(looks, 4);
}

/// Stopped while a frame waits for room: it is written, because the writer goes on to the last one.
TEST(Recorder, StoppingLosesNoFrameOfASourceThatWaits) {
  Recording r;
  std::deque<Delivery> script;
  for (std::uint64_t id = 1; id <= 9; ++id) script.push_back(frame_delivery(id, thermal_pixels()));
  ScriptedSource source("thermal0", Modality::thermal, script);
  source.waits = true;
  std::atomic<int> taken{0};
  source.before_next = [&] { ++taken; };
  std::atomic<bool> cancel{false};
  Progress progress;
  progress.cancel = &cancel;
  RecorderOptions options;
  options.queue_frames = 1;
  Recorder recorder(*r.writer, options);
  recorder.on_frame = [&](const StoredFrame& f) {
    if (f.record.sequence != 1) return;
    while (taken < 3) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    cancel = true;  // 2 is queued, 3 in hand
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  };
  EXPECT_FALSE(recorder.run({&source}, progress));
  const Session session = r.open();
  expect_exact_accounts(session);
  EXPECT_EQ(session.frames.size(), 3u);
  EXPECT_TRUE(session.gaps.empty());
}

/// The folder of the images is gone from frame 6 on: a camera's frames are lost then, and those of
/// a source that waits are left for later.
TEST(Recorder, FramesThatCannotBeWrittenAreLostOnlyToACamera) {
  for (const bool waits : {false, true}) {
    Recording r;
    std::deque<Delivery> script;
    for (std::uint64_t id : {1, 2, 5, 6, 7, 10})
      script.push_back(frame_delivery(id, thermal_pixels()));
    script.push_back(rejected_delivery(11, "short"));
    ScriptedSource source("thermal0", Modality::thermal, script);
    source.waits = waits;
    Recorder recorder(*r.writer, {});
    const auto images = r.folder / "s" / "thermal";
    recorder.on_frame = [&](const StoredFrame& f) {
      if (f.record.sequence != 5) return;
      while (recorder.status()[0].last_id < 11)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      std::filesystem::rename(images, r.folder / "kept");
      test::put(images, "no folder");
    };
    EXPECT_FALSE(recorder.run({&source}));
    std::filesystem::remove(images);
    std::filesystem::rename(r.folder / "kept", images);
    const Session session = r.open();
    expect_exact_accounts(session);
    const StreamStatus s = recorder.status()[0];
    EXPECT_EQ(s.received, 3u);
    EXPECT_EQ(s.last_id, waits ? 5u : 11u);
    EXPECT_EQ(s.missing, waits ? 2u : 4u);
    EXPECT_EQ(s.rejected, waits ? 0u : 1u);
    EXPECT_EQ(s.dropped, 0u);  // the disk was not slow
    EXPECT_EQ(s.unwritten, waits ? 0u : 3u);
    EXPECT_EQ(session.events.size(), waits ? 1u : 0u);
  }
}

/// The disk is full when 3 and 4 are to be told, and has room again at the end.
TEST(Recorder, AGapThatAFullDiskRefusesIsToldAtTheEnd) {
  Recording r;
  std::deque<Delivery> script;
  for (std::uint64_t id : {1, 2, 5, 6}) script.push_back(frame_delivery(id, thermal_pixels()));
  ScriptedSource source("thermal0", Modality::thermal, script);
  Recorder recorder(*r.writer, {});
  std::optional<test::FileSizeLimit> full;
  std::atomic<bool> filled = false;
  recorder.on_frame = [&](const StoredFrame& f) {
    if (f.record.sequence != 2) return;
    full.emplace(std::filesystem::file_size(r.folder / "s" / "manifest.jsonl") + 20);
    filled = true;
  };
  int asked = 0;
  source.before_next = [&] {
    if (++asked != 3) return;
    while (!filled) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  source.at_stop = [&] {
    while (recorder.status()[0].unwritten == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    full.reset();
  };
  EXPECT_FALSE(recorder.run({&source}));
  const Session session = r.open();
  expect_exact_accounts(session);
  EXPECT_EQ(session.frames.size(), 2u);
  EXPECT_EQ(session.gaps.size(), 2u);
}

TEST(Recorder, WhatAResumedStreamSkipsAtItsBeginningIsMissing) {
  Recording r;
  ScriptedSource source("thermal0", Modality::thermal, {frame_delivery(9, thermal_pixels())});
  RecorderOptions options;
  options.next_ids["thermal0"] = 7;
  Recorder recorder(*r.writer, options);
  ASSERT_TRUE(recorder.run({&source}));
  const Session session = r.open();
  expect_exact_accounts(session);
  EXPECT_EQ(session.streams.at(0).first_sequence, 7u);
  EXPECT_EQ(session.streams.at(0).lost, 2u);
}

TEST(Recorder, WaitingLosesNothing) {
  Recording r;
  std::deque<Delivery> script;
  for (std::uint64_t id = 1; id <= 40; ++id) script.push_back(frame_delivery(id, thermal_pixels()));
  ScriptedSource source("thermal0", Modality::thermal, script);
  RecorderOptions options;
  options.queue_frames = 1;
  options.backpressure = Backpressure::wait;
  Recorder recorder(*r.writer, options);
  ASSERT_TRUE(recorder.run({&source}));
  EXPECT_EQ(recorder.status()[0].received, 40u);
}

TEST(Recorder, OneCameraFailsTheOtherGoesOn) {
  Recording r;
  ScriptedSource broken("thermal0", Modality::thermal, {frame_delivery(3, thermal_pixels())});
  broken.fail_at_end = true;
  std::deque<Delivery> photos;
  for (std::uint64_t id = 0; id < 20; ++id)
    photos.push_back(frame_delivery(id, cv::Mat(20, 20, CV_8UC3, cv::Scalar(1, 2, 3))));
  ScriptedSource visible("visible0", Modality::visible, photos);
  visible.pause = std::chrono::milliseconds(2);
  RecorderOptions options;
  options.backpressure = Backpressure::wait;
  Recorder recorder(*r.writer, options);
  const Status status = recorder.run({&broken, &visible});
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  const Session session = r.open();
  expect_exact_accounts(session);
  EXPECT_EQ(session.frames.size(), 21u);
  ASSERT_EQ(session.events.size(), 1u);
  EXPECT_EQ(session.events[0].kind, "stream-error");
}

TEST(Recorder, CameraThatDoesNotStart) {
  Recording r;
  ScriptedSource source("thermal0", Modality::thermal, {});
  source.fail_start = true;
  Recorder recorder(*r.writer, {});
  EXPECT_FALSE(recorder.run({&source}));
  EXPECT_EQ(source.stops, 1);
  EXPECT_TRUE(r.open().streams.empty());
}

/// Photos come when they come; a camera that sends nothing is silent, and so is a folder that is
/// gone.
TEST(Recorder, SilenceIsAnAlarmForCamerasAndForFoldersThatAreGone) {
  for (const bool waits : {false, true}) {
    Recording r;
    const Delivery gone = event_delivery(EventKind::disconnected, "unplugged"),
                   back = event_delivery(EventKind::reconnected, "");
    ScriptedSource source(
        "thermal0", Modality::thermal,
        {Delivery{}, gone, Delivery{}, back, Delivery{}, frame_delivery(1, thermal_pixels())});
    source.waits = waits;
    RecorderOptions options;
    options.silence = std::chrono::milliseconds(0);
    Recorder recorder(*r.writer, options);
    std::vector<bool> silent;
    source.before_next = [&] { silent.push_back(recorder.status().at(0).silent); };
    ASSERT_TRUE(recorder.run({&source}));
    EXPECT_EQ(silent, (std::vector<bool>{false, !waits, false, true, false, !waits})) << waits;
  }
}

/// One damaged frame holds up those behind it for a third of a second: that is no silence.
TEST(Recorder, AMomentWithoutAFrameIsNoSilence) {
  Recording r;
  ScriptedSource source(
      "thermal0", Modality::thermal,
      {frame_delivery(1, thermal_pixels()), Delivery{}, rejected_delivery(2, "short"), Delivery{},
       frame_delivery(3, thermal_pixels())});
  RecorderOptions options;
  options.silence = std::chrono::hours(1);
  Recorder recorder(*r.writer, options);
  bool silent = false;
  source.before_next = [&] { silent = silent || recorder.status().at(0).silent; };
  ASSERT_TRUE(recorder.run({&source}));
  EXPECT_FALSE(silent);
}

/// Delivers its script, then nothing, until the recording is stopped.
class EndlessSource final : public ScriptedSource {
 public:
  using ScriptedSource::ScriptedSource;
  Result<Delivery> next(std::chrono::milliseconds timeout) override {
    Result<Delivery> delivery = ScriptedSource::next(timeout);
    if (delivery->kind != Delivery::Kind::end) return delivery;
    exhausted = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Delivery{};
  }
  std::vector<Delivery> unfinished() override { return last_words; }

  std::vector<Delivery> last_words;
  std::atomic<bool> exhausted{false};
};

Status run_until_exhausted(Recorder& recorder, EndlessSource& source) {
  std::atomic<bool> cancel{false};
  Progress progress;
  progress.cancel = &cancel;
  std::jthread stopper([&] {
    while (!source.exhausted) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    cancel = true;
  });
  return recorder.run({&source}, progress);
}

TEST(Recorder, ACameraThatIsAwayAtTheEndIsAnErrorAndItsOutageIsLost) {
  Recording r;
  EndlessSource source("thermal0", Modality::thermal,
                       {frame_delivery(1, thermal_pixels()), frame_delivery(2, thermal_pixels()),
                        event_delivery(EventKind::disconnected, "no frame for a second")});
  Delivery lost;
  lost.kind = Delivery::Kind::lost;
  lost.frame.id = 42;
  lost.reason = "no frame for the last 1.3 s";
  source.last_words = {rejected_delivery(3, "short"), lost};
  Recorder recorder(*r.writer, {});
  const Status status = run_until_exhausted(recorder, source);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_NE(status.error().message().find("away for the last"), std::string::npos);
  const StreamStatus s = recorder.status().at(0);
  ASSERT_TRUE(s.away);
  EXPECT_EQ(s.away->why, "no frame for a second");
  EXPECT_EQ(s.received, 2u);
  EXPECT_EQ(s.rejected, 1u);
  EXPECT_EQ(s.missing, 39u);
  EXPECT_EQ(s.last_id, 42u);
  expect_exact_accounts(r.open());
}

TEST(Recorder, ALiveCameraThatNeverDeliveredIsAnError) {
  Recording r;
  EndlessSource source("thermal0", Modality::thermal, {});
  Recorder recorder(*r.writer, {});
  const Status status = run_until_exhausted(recorder, source);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_NE(status.error().message().find("not one frame"), std::string::npos);
}

TEST(Recorder, FramesThatComeAgainAreNoFilesAndCorrectionsAreTold) {
  Recording r;
  ScriptedSource source("thermal0", Modality::thermal,
                        {frame_delivery(1, thermal_pixels()),
                         event_delivery(EventKind::repeated_id, "frame id 1 again"),
                         event_delivery(EventKind::nuc_failed, "it does not answer")});
  Recorder recorder(*r.writer, {});
  ASSERT_TRUE(recorder.run({&source}));
  const StreamStatus s = recorder.status().at(0);
  EXPECT_EQ(s.repeated, 1u);
  EXPECT_EQ(s.passed_over, 0u);
  EXPECT_EQ(s.corrections, 1u);
  EXPECT_EQ(s.correction, "no shutter correction (NUC): it does not answer");
}

TEST(Recorder, CancelKeepsWhatWasQueued) {
  Recording r;
  std::deque<Delivery> script;
  for (std::uint64_t id = 1; id <= 1000; ++id)
    script.push_back(frame_delivery(id, thermal_pixels()));
  ScriptedSource source("thermal0", Modality::thermal, script);
  source.pause = std::chrono::milliseconds(1);
  std::atomic<bool> cancel{false};
  Progress progress;
  progress.cancel = &cancel;
  Recorder recorder(*r.writer, {});
  recorder.on_frame = [&](const StoredFrame& f) { cancel = f.record.sequence >= 5; };
  const Status status = recorder.run({&source}, progress);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::cancelled);
  const Session session = r.open();
  expect_exact_accounts(session);
  EXPECT_GE(session.frames.size(), 5u);
  EXPECT_LT(session.frames.size(), 1000u);
}

TEST(Recorder, TooLittleDiskIsToldBeforeTheFirstFrame) {
  Recording r;
  ScriptedSource source("thermal0", Modality::thermal, {});
  RecorderOptions options;
  options.min_free_bytes = ~0ull >> 1;
  Recorder recorder(*r.writer, options);
  const Status status = recorder.run({&source});
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message().find("free"), std::string::npos);
}

TEST(Recorder, OptionsNameTheField) {
  RecorderOptions options;
  options.queue_frames = 0;
  EXPECT_NE(options.validate().error().where.find("queue_frames"), std::string::npos);
}

TEST(Recorder, FilesPassedOverAreCountedAndTheLastAreNamed) {
  Recording r;
  std::deque<Delivery> script;
  for (const char* name : {"1", "2", "3", "4"}) {
    script.push_back(event_delivery(*name % 2 ? EventKind::ignored : EventKind::duplicate, name));
  }
  ScriptedSource photos("visible0", Modality::visible, script);
  Recorder recorder(*r.writer, {});
  ASSERT_TRUE(recorder.run({&photos}));
  const StreamStatus status = recorder.status().at(0);
  EXPECT_EQ(status.passed_over, 4u);
  EXPECT_EQ(status.passed_over_last, (std::vector<std::string>{"2", "3", "4"}));
  EXPECT_FALSE(status.any());
}

}  // namespace
}  // namespace orbitfuse
