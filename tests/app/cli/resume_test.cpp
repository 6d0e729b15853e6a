// SPDX-License-Identifier: BSD-3-Clause
// A replay that Ctrl-C cut short goes on where it stopped, as its message says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "core/image/image_io.hpp"
#include "core/session/session.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/core/session/session_account.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using testing::HasSubstr;

/// Ids and content of each device's frames, in order.
std::map<std::string, std::vector<std::pair<std::uint64_t, std::string>>> frames_of(
    const std::string& folder) {
  std::map<std::string, std::vector<std::pair<std::uint64_t, std::string>>> list;
  const auto session = open_session(folder);
  EXPECT_TRUE(session) << session.error().message();
  if (!session) return list;
  EXPECT_TRUE(session->complete);
  test::expect_each_id_once(*session);
  for (const FrameRecord& frame : session->frames)
    list[frame.device].emplace_back(frame.sequence, frame.content_hash);
  for (auto& [device, frames] : list) std::sort(frames.begin(), frames.end());
  for (const StreamRecord& s : session->streams)
    EXPECT_EQ(s.received + s.lost, s.last_sequence - s.first_sequence + 1);
  return list;
}

class Resumed : public ::testing::Test {
 protected:
  /// A recording of `once` that was killed after some frames.
  void make_killed_recording(int frames) {
    std::filesystem::copy(once, again, std::filesystem::copy_options::recursive);
    std::ifstream whole(once + "/manifest.jsonl");
    std::ofstream cut(again + "/manifest.jsonl");
    for (std::string line; frames > 0 && std::getline(whole, line);) {
      cut << line << "\n";
      frames -= line.find("\"type\":\"frame\"") != std::string::npos;
    }
  }
  void resume(std::vector<std::string> command) {
    command.emplace_back("--resume");
    const Outcome rest = orbitfuse_program(command);
    EXPECT_EQ(rest.code, 0) << rest.err;
    EXPECT_EQ(frames_of(again), frames_of(once));
    const Outcome nothing_new = orbitfuse_program(command);
    EXPECT_EQ(nothing_new.code, 0) << nothing_new.err;
    EXPECT_THAT(nothing_new.err + nothing_new.out, HasSubstr("frames are in the session already"));
    EXPECT_EQ(frames_of(again), frames_of(once));
  }

  const test::TempFolder temp;
  const std::string once = temp.path() / "once", again = temp.path() / "again";
};

/// Frames large enough to be interrupted among them.
TEST_F(Resumed, SyntheticWalkGoesOnAfterCtrlC) {
  // Long enough that the word is seen and the signal comes while it walks, on a busy machine too:
  // with 12 small frames it was over between two looks.
  const std::vector<std::string> camera = {"--visible", "synthetic,size=240x180,spacing=10"};
  ASSERT_EQ(orbitfuse_program({"capture", once, camera[0], camera[1]}).code, 0);
  const Outcome cut = orbitfuse_program({"capture", again, camera[0], camera[1], "-v"},
                                        {.interrupt_after = "visible 1"});
  ASSERT_EQ(cut.code, 130) << cut.err << cut.out;
  EXPECT_THAT(cut.err, HasSubstr("with --resume goes on"));
  resume({"capture", again, camera[0], camera[1]});
}

/// ssh that breaks off, or a terminal that is closed: the recording ends as it does by Ctrl-C, and
/// under nohup it goes on.
TEST_F(Resumed, ATerminalThatGoesAwayEndsARecordingProperly) {
  const auto walk = [&](const std::string& spacing) {
    return std::vector<std::string>{
        ORBITFUSE_BINARY_DIR "/app/orbitfuse",       "capture", again, "--visible",
        "synthetic,size=240x180,spacing=" + spacing, "-v"};
  };
  const RunOptions hangup{.interrupt_after = "visible 1", .signal = SIGHUP, .signals = 2};
  const Outcome cut = run_program(walk("10"), hangup);
  ASSERT_EQ(cut.code, 130) << cut.err << cut.out;
  EXPECT_THAT(cut.err, HasSubstr("with --resume goes on"));
  std::filesystem::remove_all(again);
  std::vector<std::string> words = walk("60");
  words.insert(words.begin(), "nohup");
  const Outcome whole = run_program(words, hangup);
  EXPECT_TRUE(whole.signalled) << whole.err;
  EXPECT_EQ(whole.code, 0) << whole.err;
  EXPECT_TRUE(open_session(again)->complete);
}

TEST_F(Resumed, ReplayedSessionGoesOn) {
  ASSERT_EQ(
      orbitfuse_program({"capture", once, "--driver", "synthetic,size=64x48,spacing=60"}).code, 0);
  make_killed_recording(9);
  resume({"capture", again, "--driver", "replay:" + once});
}

TEST_F(Resumed, ReplayVerbToo) {
  ASSERT_EQ(
      orbitfuse_program({"capture", once, "--driver", "synthetic,size=64x48,spacing=60"}).code, 0);
  make_killed_recording(14);
  resume({"replay", once, "--to", again});
}

TEST_F(Resumed, AnotherObjectIsNotReplayedIntoABegunSession) {
  ASSERT_EQ(
      orbitfuse_program({"capture", once, "--visible", "synthetic,size=64x48,spacing=60"}).code, 0);
  make_killed_recording(5);
  cv::Mat image(48, 64, CV_8UC3);
  cv::randu(image, 0, 255);
  ASSERT_TRUE(write_png(temp.path() / "photo.png", image));
  const std::string other = temp.path() / "other";
  ASSERT_EQ(orbitfuse_program({"import", other, "--visible", temp.path() / "photo.png"}).code, 0);
  const std::string before = test::get(again + "/manifest.jsonl");
  const Outcome refused = orbitfuse_program({"replay", other, "--to", again, "--resume"});
  EXPECT_EQ(refused.code, 3) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("holds 5 frames, none of them of " + other));
  const Outcome forced = orbitfuse_program({"replay", once, "--to", again, "--force"});
  EXPECT_EQ(forced.code, 2) << forced.err;
  EXPECT_THAT(forced.err, HasSubstr("never overwritten"));
  EXPECT_TRUE(test::get(again + "/manifest.jsonl") == before);
}

TEST_F(Resumed, DamagedFramesAreNotSaidToBeThere) {
  ASSERT_EQ(
      orbitfuse_program({"capture", once, "--visible", "synthetic,size=64x48,spacing=60"}).code, 0);
  std::ofstream(once + "/visible/000004.jpg", std::ios::app) << "damage";
  const std::vector<std::string> command = {"capture", again, "--visible", "replay:" + once};
  ASSERT_EQ(orbitfuse_program(command).code, 0);
  const Outcome rest =
      orbitfuse_program({command[0], command[1], command[2], command[3], "--resume"});
  EXPECT_EQ(rest.code, 0);
  EXPECT_THAT(rest.err, HasSubstr("11 of 12 frames are in the session already, the last one too"));
}

/// Another session of the same camera is no repetition: its frames come after the first one's.
TEST_F(Resumed, AnotherSessionIsAppended) {
  ASSERT_EQ(
      orbitfuse_program({"capture", once, "--visible", "synthetic,size=64x48,spacing=60"}).code, 0);
  const std::string other = temp.path() / "other";
  ASSERT_EQ(
      orbitfuse_program({"capture", other, "--visible", "synthetic,size=80x60,spacing=60"}).code,
      0);
  ASSERT_EQ(orbitfuse_program(
                {"capture", again, "--driver", "replay:" + once, "--visible", "replay:" + once})
                .code,
            3)
      << "it has no thermal frames";
  ASSERT_EQ(orbitfuse_program({"capture", again, "--visible", "replay:" + once}).code, 0);
  ASSERT_EQ(orbitfuse_program({"capture", again, "--visible", "replay:" + other, "--resume"}).code,
            0);
  const auto frames = frames_of(again).at("visible0");
  ASSERT_EQ(frames.size(), 24u);
  EXPECT_EQ(frames.back().first, 23u);
}

}  // namespace
}  // namespace orbitfuse
