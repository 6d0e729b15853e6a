// SPDX-License-Identifier: BSD-3-Clause
// Bad input: a message that names the file and the remedy, the documented exit code, and every
// earlier output as it was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

/// Everything below a folder, by content.
std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().filename() != "run.json")
      files[fs::relative(entry.path(), folder)] = *file_hash(entry.path());
  return files;
}

class BadInput : public testing::Test {
 protected:
  void make_session(const FixtureOptions& options = {.thermal = few_thermal}) {
    write_fixture_session(session, options);
  }
  Outcome poses(const RunOptions& options = {}) {
    return orbitfuse_program({"poses", session.string(), "--out", out.string(), "--set",
                              "poses.check_known_poses=" + checked},
                             options);
  }
  fs::path first_file(const std::string& modality) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(session / modality))
      if (entry.path().extension() != ".json") files.push_back(entry.path());
    return *std::min_element(files.begin(), files.end());
  }
  /// The stage ran before; after the damage it must fail and leave what it made.
  void expect_failure_keeps_results(int code, const std::string& mention) {
    const Outcome failed = poses();
    EXPECT_EQ(failed.code, code) << failed.err;
    EXPECT_THAT(failed.err, HasSubstr(mention));
    EXPECT_THAT(failed.err, HasSubstr("; ")) << "a remedy follows what was found";
    EXPECT_EQ(contents(out), before);
  }
  void run_before_the_damage() {
    const Outcome good = poses();
    ASSERT_EQ(good.code, 0) << good.err;
    before = contents(out);
    ASSERT_FALSE(before.empty());
  }

  test::TempFolder temp;
  fs::path session = temp.path() / "session", out = temp.path() / "out";
  std::map<std::string, std::string> before;
  std::string checked = "true";  ///< "false": no field is trained to check many thermal poses
};

TEST_F(BadInput, MissingFolder) {
  const Outcome outcome = poses();
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, HasSubstr(session.string()));
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(BadInput, FolderThatIsNoSession) {
  fs::create_directories(session);
  EXPECT_EQ(poses().code, 3);
}

TEST_F(BadInput, OneImage) {
  make_session({.visible = 1, .thermal = 0, .known_poses = false});
  const Outcome outcome = poses();
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("visible"));
}

TEST_F(BadInput, TruncatedVisible) {
  make_session();
  run_before_the_damage();
  const fs::path file = first_file("visible");
  fs::resize_file(file, fs::file_size(file) / 2);
  expect_failure_keeps_results(3, file.filename().string());
}

TEST_F(BadInput, TruncatedThermal) {
  make_session();
  run_before_the_damage();
  const fs::path file = first_file("thermal");
  fs::resize_file(file, fs::file_size(file) / 2);
  expect_failure_keeps_results(3, file.filename().string());
}

TEST_F(BadInput, MissingFrame) {
  make_session({});
  checked = "false";
  run_before_the_damage();
  const fs::path file = first_file("thermal");
  fs::remove(file);
  // A frame lost from the folder doesn't cost the others.
  const Outcome outcome = poses();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr(file.filename().string()));
  EXPECT_THAT(outcome.err, HasSubstr("11 of 11 views"));
}

TEST_F(BadInput, TextNamedAsAnImage) {
  make_session();
  run_before_the_damage();
  const fs::path file = first_file("visible");
  std::ofstream(file, std::ios::trunc) << "not an image";
  expect_failure_keeps_results(3, file.filename().string());
}

TEST_F(BadInput, SixteenBitWhereEightIsExpected) {
  make_session();
  run_before_the_damage();
  const fs::path file = first_file("visible");
  ASSERT_TRUE(write_png(file, cv::Mat(72, 96, CV_16UC1, cv::Scalar(30000))));
  expect_failure_keeps_results(3, file.filename().string());
}

TEST_F(BadInput, AnotherSizeThanTheManifestSays) {
  make_session();
  run_before_the_damage();
  const fs::path file = first_file("visible");
  ASSERT_TRUE(write_png(file, cv::Mat(50, 60, CV_8UC3, cv::Scalar(1, 2, 3))));
  expect_failure_keeps_results(3, "60x50");
}

TEST_F(BadInput, ManifestCutInItsLastLineOpensWithAWarning) {
  make_session();
  const fs::path manifest = session / "manifest.jsonl";
  fs::resize_file(manifest, fs::file_size(manifest) - 20);
  const Outcome outcome = poses();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("warning: "));
}

TEST_F(BadInput, ManifestDamagedInItsMiddleNamesTheLine) {
  make_session();
  const fs::path manifest = session / "manifest.jsonl";
  std::string text = *read_file(manifest);
  text[text.size() / 2] = '\x01';
  std::ofstream(manifest, std::ios::trunc) << text;
  const Outcome outcome = poses();
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("manifest.jsonl"));
}

TEST_F(BadInput, NoColmapOnPath) {
  make_session({.known_poses = false});
  const Outcome outcome = poses({.environment = {"PATH=/nowhere"}});
  EXPECT_EQ(outcome.code, 6) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("colmap"));
}

/// What made one call fail must not make the next one fail, which doesn't name it.
TEST_F(BadInput, OptionsOfAFailedCallAreForgotten) {
  make_session({.known_poses = false});
  const auto options_of = [&] {
    return nlohmann::json::parse(*read_file(out / "run.json")).value("config", nlohmann::json());
  };
  const Outcome outcome = orbitfuse_program(
      {"poses", session.string(), "--out", out.string(), "--set", "poses.colmap=/no/such/colmap"});
  EXPECT_EQ(outcome.code, 6) << outcome.err;
  EXPECT_TRUE(options_of().is_null()) << options_of();
  fs::remove_all(session);
  fs::remove_all(out);
  make_session();
  ASSERT_EQ(poses().code, 0);
  const auto good = options_of();
  ASSERT_TRUE(good.is_object());
  for (const auto& entry : fs::directory_iterator(session / "visible"))
    fs::resize_file(entry.path(), 20);
  EXPECT_NE(orbitfuse_program({"poses", session.string(), "--out", out.string(), "--set",
                               "poses.max_features=17"})
                .code,
            0);
  EXPECT_EQ(options_of(), good);
}

TEST_F(BadInput, FullDisk) {
  make_session();
  fs::create_directories(out);
  const std::string script = "mount -t tmpfs -o size=16k tmpfs " + out.string() +
                             " || exit 99; " ORBITFUSE_BINARY_DIR "/app/orbitfuse poses " +
                             session.string() + " --out " + out.string();
  const Outcome outcome = run_program({"unshare", "-rm", "sh", "-c", script});
  if (outcome.code == 99 || outcome.code == 1)
    GTEST_SKIP() << "this machine allows no private mounts: " << outcome.err;
  EXPECT_EQ(outcome.code, 4) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("space"));
}

TEST_F(BadInput, OutFolderThatCannotBeWritten) {
  make_session();
  out = "/proc/orbitfuse";
  EXPECT_EQ(poses().code, 4);
}

// The folder of an earlier run brings its options: damage there must not silently give other ones.
TEST_F(BadInput, RecordOfAnEarlierRunThatIsDamaged) {
  make_session();
  run_before_the_damage();
  const fs::path record = out / "run.json";
  const std::string good = *read_file(record);
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const std::pair<std::string, std::string> cases[] = {
      {good.substr(0, good.size() / 2), "cut off"},
      {"", "cut off"},
      {replaced("\"session\": \"", "\"session\": \"\xff"), "not JSON"},
      {"[]", "no session"},
      {replaced("\"seed\": 1", "\"seed\": -1"), "seed = -1"},
      {replaced("\"seed\": 1", "\"seed\": \"1\""), "seed = \"1\""},
      {replaced("\"config\": {", "\"config\": 7, \"old\": {"), "config = 7"},
      {replaced("\"fuse\": {", "\"fuse\": [], \"old\": {"), "fuse = []"},
      {replaced("\"max_features\": ", "\"max_features\": 0.5"), "poses.max_features = 0.5"}};
  for (const auto& [text, mention] : cases) {
    std::ofstream(record, std::ios::trunc) << text;
    const Outcome failed = orbitfuse_program({"poses", out.string()});
    EXPECT_EQ(failed.code, 3) << mention << ": " << failed.err;
    EXPECT_THAT(failed.err, HasSubstr("run.json"));
    EXPECT_THAT(failed.err, HasSubstr(mention));
    EXPECT_EQ(contents(out), before);
  }
  std::ofstream(record, std::ios::trunc) << good;
  EXPECT_EQ(orbitfuse_program({"poses", out.string()}).code, 0);
}

TEST_F(BadInput, TrainingOptionsAreNamedAsTheyAreWritten) {
  make_session();
  const std::pair<const char*, const char*> cases[] = {
      {"train.visible.iterations=many", "must be an integer in 1..10000000"},
      {"train.thermal.iterations=0",
       "train.thermal.iterations: 0; choose an integer in 1..10000000"},
      {"train.visible.color_hidden=40",
       "train.visible.color_hidden: 40; choose an integer in 16..256, a multiple of 16"},
      {"train.visible.sampling=all", "must be occupancy or proposal"},
      {"train.visible.carve=2", "must be true or false"},
      {"render.palette=\xff", "UTF-8"}};
  for (const auto& [set, mention] : cases) {
    const Outcome refused =
        orbitfuse_program({"poses", session.string(), "--out", out.string(), "--set", set});
    EXPECT_EQ(refused.code, 2) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(mention));
    EXPECT_FALSE(fs::exists(out));
  }
}

TEST_F(BadInput, ImportOfNothingReadable) {
  fs::create_directories(temp.path() / "photos");
  std::ofstream(temp.path() / "photos/a.jpg") << "text";
  const Outcome outcome = orbitfuse_program(
      {"import", session.string(), "--visible", (temp.path() / "photos").string()});
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("a.jpg"));
}

}  // namespace
}  // namespace orbitfuse
