// SPDX-License-Identifier: BSD-3-Clause
// Results whose session or record is gone, and truths that are not of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/image/image_io.hpp"
#include "core/session/session.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/app/cli/small_run.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class HostileRun : public testing::Test {
 protected:
  HostileRun() { write_fixture_session(session, {.thermal = few_thermal}); }
  void make_poses() const { ASSERT_EQ(on_out("poses", session).code, 0); }
  Outcome on_out(const std::string& verb, const fs::path& of,
                 std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {verb, of.string(), "--out", out.string()});
    return orbitfuse_program(more);
  }
  /// The session's own poses as a truth, with these frames named anew.
  json truth(const std::map<std::size_t, std::string>& renamed = {}) const {
    json frames = json::array(), k;
    const Session opened = open_session(session).value();
    for (const FrameRecord* frame : opened.frames_of(Modality::visible)) {
      const Camera& c = *frame->camera;
      k = {{"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}, {"w", c.width}, {"h", c.height}};
      const Eigen::Matrix3d turn = frame->cam_from_world->rotation.conjugate().toRotationMatrix() *
                                   Eigen::Vector3d(1, -1, -1).asDiagonal();
      const Eigen::Vector3d center = camera_center(*frame->cam_from_world);
      json c2w = json::array();
      for (int i = 0; i < 3; ++i) c2w.push_back({turn(i, 0), turn(i, 1), turn(i, 2), center[i]});
      const auto name = renamed.find(frames.size());
      frames.push_back(
          {{"file", name == renamed.end() ? frame->file : name->second}, {"c2w", c2w}});
    }
    return {{"visible", {{"K", k}, {"frames", frames}}}};
  }
  Outcome eval(const json& truth) const {
    test::put(temp / "truth.json", truth.dump());
    return on_out("eval", session, {"--ground-truth", (temp / "truth.json").string(), "--json"});
  }

  const test::TempFolder temp;
  const fs::path session = temp / "s", out = temp / "o";
};

TEST_F(HostileRun, ResultsWhoseSessionIsGoneSaySo) {
  make_poses();
  fs::rename(session, temp / "moved");
  const Outcome told = orbitfuse_program({"inspect", out.string(), "--json"});
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_EQ(told.result().at("session_found"), false);
  EXPECT_THAT(told.err, HasSubstr("its session " + session.string() + " is not there any more"));
  const Outcome refused = orbitfuse_program({"poses", out.string()});
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, HasSubstr("name the session where it is now, with --out"));
  EXPECT_EQ(on_out("poses", temp / "moved").code, 0);
  EXPECT_EQ(orbitfuse_program({"inspect", out.string(), "--json"}).result().at("session_found"),
            true);
}

/// Another session under the name: its files are called alike, and would be shown as the run's.
TEST_F(HostileRun, AnotherSessionInItsPlaceIsNotTheRuns) {
  ASSERT_EQ(orbitfuse_program(small_run(session, out)).code, 0);
  const std::vector<std::string> words = {"export", out.string(), "--dataset",
                                          (temp / "pairs").string(), "--dry-run"};
  EXPECT_EQ(orbitfuse_program(words).err.find("are not those that"), std::string::npos);
  fs::rename(session, temp / "moved");
  FixtureOptions smaller;
  smaller.thermal = 11;
  write_fixture_session(session, smaller);
  const std::string said =
      session.string() + ": its thermal frames are not those that " + out.string() + " was made of";
  EXPECT_THAT(orbitfuse_program({"inspect", out.string()}).err, HasSubstr(said));
  EXPECT_THAT(orbitfuse_program({"view", out.string(), "--page", "0", "--dry-run"}).err,
              HasSubstr("photos cannot be shown: " + said));
  std::vector<std::string> real = words;
  real.pop_back();
  const Outcome pairs = orbitfuse_program(real);
  EXPECT_EQ(pairs.code, 3);
  EXPECT_FALSE(fs::exists(temp / "pairs"));
}

/// A whole field, and not this run's: its colours would be shown as temperatures.
TEST_F(HostileRun, AFieldThatNoStageOfTheRunWroteIsNotItsOwn) {
  ASSERT_EQ(orbitfuse_program(small_run(session, out)).code, 0);
  fs::copy_file(out / "train_visible/field.bin", out / "train_thermal/field.bin",
                fs::copy_options::overwrite_existing);
  const std::string to = (temp / "x.ply").string();
  const std::vector<std::vector<std::string>> calls = {
      {"measure", out.string(), "--hottest", "1"},
      {"export", out.string(), "--to", to, "--dry-run"},
      {"view", out.string(), "--page", "0"}};
  for (const auto& words : calls) {
    const Outcome refused = orbitfuse_program(words);
    EXPECT_EQ(refused.code, 3) << words[0];
    EXPECT_THAT(refused.err, HasSubstr("train_thermal: field.bin was changed; restore it"));
  }
}

/// A training's own run.json was written over, also where nothing could be run.
TEST_F(HostileRun, RecordsThatNoRunLeftAreTheUsersOwn) {
  for (const char* file : {"run.json", "plan.json"}) {
    const std::string mine = R"({"my": "training config"})";
    test::put(out / file, mine);
    for (const std::string more : {"--dry-run", "--force"}) {
      const Outcome refused =
          orbitfuse_program({"run", session.string(), "--out", out.string(), more});
      EXPECT_EQ(refused.code, 2) << file << more;
      EXPECT_THAT(refused.err, HasSubstr(std::string(file) + ": is there already"));
    }
    EXPECT_EQ(test::get(out / file), mine);
    fs::remove(out / file);
  }
}

/// It would be refused by the next call; `inspect` passed it.
TEST_F(HostileRun, OptionsOfARunThatCannotBeUsedAreToldByInspect) {
  make_poses();
  json run = json::parse(test::get(out / "run.json"));
  run["seed"] = -1;
  test::put(out / "run.json", run.dump());
  const Outcome told = orbitfuse_program({"inspect", out.string(), "--json"});
  EXPECT_EQ(told.code, 3);
  EXPECT_THAT(told.err, HasSubstr("run.json: seed = -1"));
  test::put(out / "render.failed/failed.json", R"({"error":"render: too dark"})");
  test::put(out / "fuse.failed/mine.txt", "a folder of the user's own");
  const Outcome failed = orbitfuse_program({"inspect", out.string(), "--json"});
  EXPECT_EQ(failed.result().at("failed"), json({{"fuse", "?"}, {"render", "render: too dark"}}));
  EXPECT_THAT(failed.err, HasSubstr("render failed: render: too dark"));
  EXPECT_THAT(failed.err, HasSubstr("fuse.failed: there, but no run left it"));
}

TEST_F(HostileRun, ResultsWithoutTheirRecordAreNoSession) {
  make_poses();
  fs::remove(out / "run.json");
  const Outcome told = orbitfuse_program({"inspect", out.string(), "--json"});
  EXPECT_EQ(told.code, 3);
  EXPECT_THAT(told.err, HasSubstr("run.json: missing"));
  EXPECT_EQ(told.result().at("stages").size(), 2u);
  const Outcome refused = orbitfuse_program({"poses", out.string()});
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, HasSubstr("results of a run, but no run.json"));
  EXPECT_EQ(on_out("poses", session).code, 0);
  EXPECT_EQ(orbitfuse_program({"inspect", out.string()}).code, 0);
}

TEST_F(HostileRun, AStagesFolderWithoutItsRecordIsToldByInspect) {
  make_poses();
  fs::remove(out / "poses_visible/stage.json");
  test::put(out / "render/mine.txt", "a folder of the user's own");
  fs::create_directories(out / "depth");  // empty: the next run takes it
  // Not to be looked into, but of no stage's name.
  fs::create_symlink("backup", out / "backup");
  const Outcome told = orbitfuse_program({"inspect", out.string(), "--json"});
  EXPECT_EQ(told.code, 3) << told.err;
  EXPECT_THAT(told.err, HasSubstr("poses_visible: its record is missing"));
  EXPECT_EQ(told.result().at("without_record"), json({"poses_visible", "render"}));
  EXPECT_THAT(told.err, HasSubstr("poses_visible: there, but without a record (stage.json)"));
  // As without the right to look into it, which a superuser always has.
  fs::create_symlink("fuse", out / "fuse");
  const Outcome unknown = orbitfuse_program({"inspect", out.string(), "--json"});
  EXPECT_EQ(unknown.code, 3);
  EXPECT_THAT(unknown.err, HasSubstr("fuse/stage.json: Too many levels of symbolic links"));
}

/// The other run would take what is new in its stage for damage, and delete it when it is made
/// anew.
TEST_F(HostileRun, NothingIsWrittenIntoAStageOfAnyRun) {
  make_poses();
  const fs::path stage = out / "poses_visible", into = stage / "new";
  const std::string photo = (session / "visible/000000.png").string(),
                    frame = (session / "thermal/000000.tiff").string();
  const auto files = [&] {
    std::set<fs::path> all;
    for (const auto& entry : fs::recursive_directory_iterator(stage)) all.insert(entry.path());
    return all;
  };
  const auto before = files();
  fs::create_directory_symlink(stage, temp / "link");
  const std::vector<std::vector<std::string>> calls = {
      {"render", session.string(), "--out", into.string()},
      {"render", session.string(), "--out", stage.string()},
      {"poses", session.string(), "--out", (temp / "link/deep/down").string(), "--dry-run"},
      {"fuse", "--visible", photo, "--thermal", frame, "--out", (stage / "f.png").string()},
      {"farm", session.string(), "--out", into.string()},
      {"replay", session.string(), "--to", into.string()},
      {"import", into.string(), "--visible", photo},
      {"import", into.string(), "--visible", photo, "--dry-run"},
      {"capture", into.string(), "--driver", "synthetic"},
      {"mat", "--out", (stage / "mat.pdf").string()},
      {"inspect", session.string(), "--trace", (stage / "trace.json").string()}};
  for (const auto& words : calls) {
    const Outcome refused = orbitfuse_program(words);
    EXPECT_EQ(refused.code, 2) << words[0] << ": " << refused.err;
    EXPECT_THAT(refused.err, HasSubstr("the result of a run's stage")) << words[0];
  }
  EXPECT_EQ(files(), before);
}

TEST_F(HostileRun, ATruthThatNamesTwoFramesAlikeMeasuresNeither) {
  make_poses();
  const Outcome whole = eval(truth());
  ASSERT_EQ(whole.code, 0) << whole.err;
  EXPECT_EQ(whole.result().at("poses_visible").at("posed"), 12);
  const Outcome twice = eval(truth({{3, "elsewhere/000004.png"}}));
  ASSERT_EQ(twice.code, 0) << twice.err;
  const json found = twice.result().at("poses_visible");
  EXPECT_EQ(found.at("posed"), 10);
  EXPECT_LT(found.at("rotation_max_deg").get<double>(), 0.1);
  EXPECT_THAT(twice.result().at("notes").dump(), HasSubstr("000004.png is there more than once"));
}

TEST_F(HostileRun, TestImagesOfAnotherCameraAreNamed) {
  std::vector<std::string> words = small_run(session, out);
  words.insert(words.end(), {"--stage", "train_visible"});
  const Outcome run = orbitfuse_program(words);
  ASSERT_EQ(run.code, 0) << run.err;
  json with_test = truth();
  with_test["test"] = {
      {"K", with_test["visible"]["K"]},
      {"frames", {{{"c2w", with_test["visible"]["frames"][0]["c2w"]}, {"visible", "test.png"}}}}};
  ASSERT_TRUE(write_png(temp / "test.png", cv::Mat(36, 48, CV_8UC3, cv::Scalar::all(99))));
  EXPECT_EQ(eval(with_test).code, 0) << "the same, smaller";
  ASSERT_TRUE(write_png(temp / "test.png", cv::Mat(48, 48, CV_8UC3, cv::Scalar::all(99))));
  const Outcome refused = eval(with_test);
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, HasSubstr("test.png: 48x48 pixels; test.K of the truth is for 96x72"));
}

}  // namespace
}  // namespace orbitfuse
