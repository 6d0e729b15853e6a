// SPDX-License-Identifier: BSD-3-Clause
// A replay that was stopped and resumed accounts for every frame of its recording exactly once.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "app/recording/recording.hpp"
#include "drivers/replay/replay_source.hpp"
#include "tests/capture/scripted_source.hpp"
#include "tests/core/session_account.hpp"
#include "tests/core/temp_folder.hpp"

namespace orbitfuse::recording {
namespace {

class ResumedReplay : public ::testing::Test {
 protected:
  /// Ids 5 to 34 with frames; 8 to 10, 20 and 30 are missing.
  void SetUp() override {
    auto writer = *SessionWriter::create(once);
    DeviceInfo device;
    device.id = "thermal0";
    device.modality = Modality::thermal;
    ASSERT_TRUE(writer->add_device(device));
    for (std::uint64_t id = 5; id < 35; ++id) {
      if ((id >= 8 && id <= 10) || id == 20 || id == 30) continue;
      cv::Mat pixels = test::thermal_pixels();
      pixels.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>(29000 + id);
      ASSERT_TRUE(writer->append("thermal0", test::frame_delivery(id, pixels).frame));
    }
    ASSERT_TRUE(writer->close());
  }

  std::vector<std::unique_ptr<FrameSource>> replayed() const {
    return make_replay_sources(*open_session(once), ReplaySpeed::full);
  }

  /// The replay until it ends or is stopped by the user.
  void replay(bool resume, const std::atomic<bool>* cancel = nullptr) const {
    RecordingOptions options;
    options.session = again;
    options.resume = resume;
    Recording recording(replayed(), options);
    ASSERT_TRUE(recording.prepare());
    const auto ending = recording.run(cancel);
    ASSERT_TRUE(ending || ending.error().kind == ErrorKind::cancelled) << ending.error().message();
  }

  /// A replay that was stopped after some manifest lines of the whole one.
  void cut_after(std::size_t lines, const std::string& last_line = {}) const {
    std::filesystem::remove_all(again);
    replay(false);
    std::ifstream whole(again / "manifest.jsonl");
    std::string text, line;
    for (std::size_t i = 0; i < lines && std::getline(whole, line); ++i) text += line + "\n";
    test::put(again / "manifest.jsonl", text + last_line);
  }

  std::size_t lines_of_the_whole() const {
    cut_after(1000);
    const std::string text = test::get(again / "manifest.jsonl");
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  /// Each good frame of the recording is there once, and so is each id.
  Session expect_all(std::size_t frames, std::uint64_t lost) const {
    const Session session = *open_session(again);
    test::expect_each_id_once(session);
    EXPECT_EQ(session.frames.size(), frames);
    std::set<std::string> contents;
    for (const FrameRecord& f : session.frames) contents.insert(f.content_hash);
    EXPECT_EQ(contents.size(), frames);
    std::uint64_t gaps = 0;
    for (const GapRecord& g : session.gaps) gaps += g.count;
    EXPECT_EQ(gaps, lost);
    return session;
  }

  const test::TempFolder folder;
  const std::filesystem::path once = folder / "once", again = folder / "again";
};

TEST_F(ResumedReplay, StoppedAnywhereItAccountsAsIfItHadNotBeen) {
  test::put(once / "thermal/000006.tiff", "damaged");
  test::put(once / "thermal/000024.tiff", "damaged, the last one");
  const std::size_t lines = lines_of_the_whole();
  for (std::size_t kept = 3; kept <= lines; ++kept) {
    SCOPED_TRACE(kept);
    cut_after(kept);
    test::expect_each_id_once(*open_session(again));
    replay(true);
    const Session session = expect_all(23, 5 + 2);
    EXPECT_EQ(session.frames.front().sequence, 5u);
    EXPECT_EQ(session.frames.back().sequence, 33u);
    if (HasFailure()) return;
  }
}

/// Whoever stopped it had a frame in hand, which an older recorder wrote as lost.
TEST_F(ResumedReplay, FrameThatTheSessionCountsAsLostComesUnderANewId) {
  cut_after(2 + 3, manifest_line(GapRecord{"thermal0", 8, 4, "dropped: the disk is too slow"}) + "\n");
  ASSERT_EQ(open_session(again)->frames.size(), 3u);
  replay(true);
  const Session session = expect_all(25, 4 + 2);
  EXPECT_EQ(session.frames[3].sequence, 12u);
  EXPECT_EQ(session.frames.back().sequence, 35u);
}

TEST_F(ResumedReplay, StoppedByTheUserAgainAndAgainItLosesNothing) {
  for (int stops = 0; stops < 4; ++stops) {
    // Set from the start: what the source has given by then is written all the same.
    const std::atomic<bool> cancel{true};
    replay(stops > 0, &cancel);
    test::expect_each_id_once(*open_session(again));
  }
  replay(true);
  expect_all(25, 5);
}

}  // namespace
}  // namespace orbitfuse::recording
