// SPDX-License-Identifier: BSD-3-Clause
// A replay that was stopped and resumed accounts for every frame of its recording exactly once.
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "app/recording/recording.hpp"
#include "drivers/replay/replay_source.hpp"
#include "tests/capture/scripted_source.hpp"
#include "tests/core/session/session_account.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::recording {
namespace {

class ResumedReplay : public ::testing::Test {
 protected:
  /// Ids 5 to 17 with frames; 8 to 10 and 14 are missing.
  void SetUp() override {
    auto writer = *SessionWriter::create(once);
    DeviceInfo device;
    device.id = "thermal0";
    device.modality = Modality::thermal;
    ASSERT_TRUE(writer->add_device(device));
    for (std::uint64_t id = 5; id < 18; ++id) {
      if ((id >= 8 && id <= 10) || id == 14) continue;
      cv::Mat pixels = test::thermal_pixels();
      pixels.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>(29000 + id);
      ASSERT_TRUE(writer->append("thermal0", test::frame_delivery(id, pixels).frame));
    }
    ASSERT_TRUE(writer->close());
  }

  void replay(bool resume) const {
    RecordingOptions options;
    options.session = again;
    options.resume = resume;
    Recording recording(make_replay_sources(*open_session(once), ReplaySpeed::full), options);
    ASSERT_TRUE(recording.prepare());
    const auto ending = recording.run(nullptr);
    ASSERT_TRUE(ending) << ending.error().message();
  }

  /// A replay that was not stopped; its manifest lines.
  std::vector<std::string> replay_to_the_end() const {
    replay(false);
    std::ifstream manifest(again / "manifest.jsonl");
    std::vector<std::string> lines;
    for (std::string line; std::getline(manifest, line);) lines.push_back(line + "\n");
    return lines;
  }

  /// As if it had been stopped after some of its lines; images that came later may be there.
  void cut(const std::vector<std::string>& lines, std::size_t kept) const {
    std::string text;
    for (std::size_t i = 0; i < kept; ++i) text += lines[i];
    test::put(again / "manifest.jsonl", text);
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
  test::put(once / "thermal/000004.tiff", "damaged");
  test::put(once / "thermal/000008.tiff", "damaged, the last one");
  const std::vector<std::string> lines = replay_to_the_end();
  for (std::size_t kept = 3; kept <= lines.size(); ++kept) {
    SCOPED_TRACE(kept);
    cut(lines, kept);
    test::expect_each_id_once(*open_session(again));
    replay(true);
    const Session session = expect_all(7, 4 + 2);
    EXPECT_EQ(session.frames.front().sequence, 5u);
    EXPECT_EQ(session.frames.back().sequence, 16u);
    if (HasFailure()) return;
  }
}

/// Whoever stopped it had a frame in hand, which an older recorder wrote as lost.
TEST_F(ResumedReplay, FrameThatTheSessionCountsAsLostComesUnderANewId) {
  std::vector<std::string> lines = replay_to_the_end();
  lines[2 + 3] = manifest_line(GapRecord{"thermal0", 8, 4, "dropped: the disk is too slow"}) + "\n";
  cut(lines, 2 + 3 + 1);
  ASSERT_EQ(open_session(again)->frames.size(), 3u);
  replay(true);
  const Session session = expect_all(9, 4 + 1);
  EXPECT_EQ(session.frames[3].sequence, 12u);
  EXPECT_EQ(session.frames.back().sequence, 18u);
}

}  // namespace
}  // namespace orbitfuse::recording
