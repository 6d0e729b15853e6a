// SPDX-License-Identifier: BSD-3-Clause
// The whole road on a tiny session with known poses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "core/formats/ply.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class Run : public testing::Test {
 protected:
  Outcome run(std::vector<std::string> more = {}, const RunOptions& options = {},
              const std::string& verb = "run") {
    std::vector<std::string> words = {verb, session.string(), "--out", out.string(), "--json"};
    for (const char* set :
         {"train.visible.iterations=200", "train.thermal.iterations=200",
          "train.visible.eval_count=0", "train.thermal.eval_count=0", "train.visible.log2_table=13",
          "train.thermal.log2_table=13", "train.visible.cloud_width_px=32",
          "train.thermal.cloud_width_px=32", "train.visible.cloud_tolerance=0.2",
          "train.thermal.cloud_tolerance=0.2", "render.views=2", "render.width_px=64"}) {
      words.insert(words.end(), {"--set", set});
    }
    words.insert(words.end(), more.begin(), more.end());
    return orbitfuse_program(words, options);
  }
  static std::map<std::string, std::string> states(const Outcome& outcome) {
    std::map<std::string, std::string> result;
    const auto outcome_result = outcome.result();
    for (const auto& stage : outcome_result.at("stages"))
      result[stage.at("stage")] = stage.at("state");
    return result;
  }

  test::TempFolder temp;
  fs::path session = temp.path() / "session", out = temp.path() / "out";
};

TEST_F(Run, BothModalitiesThenNothingThenWhatChanged) {
  write_fixture_session(session);
  const Outcome first = run();
  ASSERT_EQ(first.code, 0) << first.err;
  for (const char* file :
       {"poses_visible/transforms.json", "poses_thermal/temperature_bounds.json",
        "train_visible/cloud.ply", "register/registration.json", "render/visible/000.png",
        "render/thermal/001.tiff", "render/palette/000.png", "render/depth/000.tiff",
        "render/transforms.json", "report/report.html", "run.json"})
    EXPECT_TRUE(fs::exists(out / file)) << file;
  const auto thermal = read_thermal_k(out / "render/thermal/000.tiff");
  ASSERT_TRUE(thermal);
  EXPECT_EQ(thermal->cols, 64);
  double low = 0, high = 0;
  cv::minMaxLoc(*thermal, &low, &high, nullptr, nullptr, *thermal == *thermal);
  EXPECT_GT(low, 270);  // the fixture holds 290 to 310 K
  EXPECT_LT(high, 330);
  EXPECT_TRUE(read_ply(out / "train_thermal/cloud.ply"));

  const Outcome second = run();
  ASSERT_EQ(second.code, 0) << second.err;
  for (const auto& [stage, state] : states(second))
    EXPECT_EQ(state, stage == "report" ? "ran" : "unchanged") << stage;

  const auto changed = states(run({"--set", "render.views=1"}));
  EXPECT_EQ(changed.at("train_visible"), "unchanged");
  EXPECT_EQ(changed.at("render"), "ran");
  EXPECT_FALSE(fs::exists(out / "render/visible/001.png"));
}

/// The plan is said before the first stage, kept, and held to when the run is called again.
TEST_F(Run, ABudgetIsPlannedSpentAndTold) {
  write_fixture_session(session);
  const auto planned = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"run", session.string(), "--out", out.string()};
    for (const char* set : {"render.views=2", "render.width_px=64", "fuse.methods=[\"heat\"]"})
      words.insert(words.end(), {"--set", set});
    words.insert(words.end(), more.begin(), more.end());
    return orbitfuse_program(words);
  };
  const Outcome tried = planned({"--budget", "12s", "--dry-run"});
  ASSERT_EQ(tried.code, 0) << tried.err;
  EXPECT_THAT(tried.err, HasSubstr("plan for 12 s: visible field "));
  EXPECT_FALSE(fs::exists(out)) << "nothing is written";

  const Outcome first = planned({"--budget", "12s"});
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_THAT(first.err, HasSubstr("plan for 12 s: visible field "));
  EXPECT_NE(read_file(out / "report/report.html")->find("Plan and outcome"), std::string::npos);
  const json plan = json::parse(*read_file(out / "plan.json"));
  const auto option = [&](const char* stage, const char* key) {
    return json::parse(*read_file(out / stage / "stage.json")).at("options").at(key);
  };
  EXPECT_EQ(option("train_visible", "budget_s"), plan["choices"]["train.visible.budget_s"]);
  EXPECT_GT(option("train_visible", "budget_s"), 0);
  EXPECT_EQ(option("metrics", "scored_views"), plan["choices"]["metrics.scored_views"]);
  // Whole runs of other options are no part of this plan; the same budget is.
  const Outcome again = planned({"--budget", "12s", "--json"});
  ASSERT_EQ(again.code, 0) << again.err;
  for (const auto& [stage, state] : states(again))
    EXPECT_EQ(state, stage == "report" ? "ran" : "unchanged") << stage;

  // The folder of the run knows its budget, and what the planner set is not the user's.
  const Outcome from_folder = orbitfuse_program({"run", out.string(), "--json"});
  ASSERT_EQ(from_folder.code, 0) << from_folder.err;
  EXPECT_EQ(from_folder.result()["budget_s"], 12);
  for (const auto& [stage, state] : states(from_folder))
    EXPECT_EQ(state, stage == "report" ? "ran" : "unchanged") << stage;
  // What is damaged there is named there.
  json record = json::parse(*read_file(out / "run.json"));
  record["planned"]["users"]["metrics.scored_views"] = "many";
  fs::create_directories(temp.path() / "damaged");
  std::ofstream(temp.path() / "damaged/run.json") << record;
  const Outcome damaged_users =
      orbitfuse_program({"run", (temp.path() / "damaged").string(), "--dry-run"});
  EXPECT_EQ(damaged_users.code, 3);
  EXPECT_THAT(damaged_users.err, HasSubstr("damaged/run.json: metrics.scored_views = \"many\""));
  const Outcome longer = orbitfuse_program({"run", out.string(), "--budget", "14s", "--dry-run"});
  EXPECT_THAT(longer.err, HasSubstr("plan for 14 s: visible field "))
      << "another, not the one before";
  // What the user gives stays, though the earlier plan had another choice.
  const Outcome given =
      planned({"--budget", "12s", "--dry-run", "--set", "train.visible.iterations=777"});
  EXPECT_THAT(given.err, HasSubstr("(777 steps)"));

  const Outcome other_recipe =
      planned({"--budget", "12s", "--dry-run", "--set", "train.visible.preset=nerfacto"});
  EXPECT_EQ(other_recipe.code, 2);
  EXPECT_THAT(other_recipe.err, HasSubstr("train.visible.budget_s"));
  const Outcome too_little = planned({"--budget", "1s", "--dry-run"});
  EXPECT_THAT(too_little.err, HasSubstr("warning: --budget: 1 s are too few"));
  ASSERT_EQ(
      planned({"--set", "train.visible.iterations=50", "--set", "train.thermal.iterations=50"})
          .code,
      0);
  EXPECT_FALSE(fs::exists(out / "plan.json")) << "this run had no budget";
  const Outcome damaged = planned({"--budget", "12s", "--dry-run"});
  EXPECT_EQ(damaged.code, 0);
}

TEST_F(Run, WhatNobodyCanMeasureIsAnErrorAndCamerasAreReadFirst) {
  write_fixture_session(session, {.thermal = 0});
  const Outcome no_cameras = run({"--cameras", (temp.path() / "none.json").string()});
  EXPECT_EQ(no_cameras.code, 3) << no_cameras.err;
  EXPECT_FALSE(fs::exists(out / "train_visible"));

  ASSERT_EQ(run({}, {}, "poses").code, 0);
  const fs::path truth = temp.path() / "truth.json";
  ASSERT_TRUE(write_file_atomic(truth, R"({"visible": {"K": {"w": 64, "h": 48, "fx": 60, "fy": 60,
      "cx": 32, "cy": 24}, "frames": [{"file": "of/another/scene.jpg",
      "c2w": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}})"));
  const Outcome foreign = orbitfuse_program(
      {"eval", session.string(), "--out", out.string(), "--ground-truth", truth.string()});
  EXPECT_EQ(foreign.code, 3) << foreign.err;
  EXPECT_THAT(foreign.err, HasSubstr("truth.json"));
}

TEST_F(Run, AFinishedRunKeepsItsOptions) {
  write_fixture_session(session, {.thermal = 0});
  ASSERT_EQ(run({"--seed", "5"}).code, 0);
  const Outcome again = orbitfuse_program({"report", out.string(), "--json"});
  ASSERT_EQ(again.code, 0) << again.err;
  for (const auto& [stage, state] : states(again))
    EXPECT_TRUE(stage == "report" || state != "ran") << stage;
  const Outcome changed =
      orbitfuse_program({"render", out.string(), "--json", "--set", "render.views=1"});
  ASSERT_EQ(changed.code, 0) << changed.err;
  EXPECT_EQ(states(changed).at("train_visible"), "unchanged");
  EXPECT_EQ(states(changed).at("render"), "ran");
}

TEST_F(Run, VisibleOnlySaysSoAndSucceeds) {
  write_fixture_session(session, {.thermal = 0});
  const Outcome outcome = run();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(states(outcome).at("poses_thermal"), "absent");
  EXPECT_THAT(outcome.err, HasSubstr("no thermal frames"));
  const auto page = read_file(out / "report/report.html");
  ASSERT_TRUE(page);
  EXPECT_THAT(*page, HasSubstr("no thermal frames"));
}

TEST_F(Run, ThermalOnlyToo) {
  write_fixture_session(session, {.visible = 0});
  const Outcome outcome = run();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(out / "render/thermal/000.tiff"));
  EXPECT_FALSE(fs::exists(out / "render/visible"));
}

TEST_F(Run, DryRunWritesNothing) {
  write_fixture_session(session);
  const Outcome outcome = run({"--dry-run"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(states(outcome).at("poses_visible"), "planned");
  const Outcome told = orbitfuse_program({"run", session, "--out", out, "--dry-run"});
  EXPECT_THAT(told.out + told.err, HasSubstr("would run"));
}

TEST_F(Run, ResultsOfAnotherSessionAreKeptUnlessForcedAndThenGoWhole) {
  write_fixture_session(session, {.thermal = few_thermal});
  ASSERT_EQ(run({}, {}, "poses").code, 0);
  const fs::path first = session, record = out / "poses_visible" / "stage.json";
  const std::string before = *read_file(record);

  FixtureOptions visible_only;
  visible_only.thermal = 0;
  session = temp.path() / "other";
  write_fixture_session(session, visible_only);
  for (const char* verb : {"run", "poses", "report"})
    for (const bool dry : {false, true}) {
      const Outcome refused =
          run(dry ? std::vector<std::string>{"--dry-run"} : std::vector<std::string>{}, {}, verb);
      EXPECT_EQ(refused.code, 2) << verb << refused.err;
      EXPECT_THAT(refused.err, HasSubstr("holds results of another session, " + first.string()));
    }
  EXPECT_EQ(*read_file(record), before);

  // Without run.json, or with one that can't be read, what the poses were made of tells.
  const std::string told = *read_file(out / "run.json");
  fs::remove(out / "run.json");
  const Outcome lost = run({}, {}, "poses");
  EXPECT_EQ(lost.code, 2) << lost.err;
  EXPECT_THAT(lost.err, HasSubstr("holds results of other frames than this session's"));
  std::ofstream(out / "run.json") << "{";
  EXPECT_EQ(run({}, {}, "poses").code, 2);
  EXPECT_EQ(*read_file(record), before);
  ASSERT_TRUE(write_file_atomic(out / "run.json", told));

  fs::create_directories(out / "mine");
  for (const char* file : {"mine/stage.json", "measurements.json"})
    ASSERT_TRUE(write_file_atomic(out / file, "{}"));
  const Outcome forced = run({"--force"}, {}, "poses");
  EXPECT_EQ(forced.code, 0) << forced.err;
  EXPECT_THAT(forced.out, HasSubstr("are removed first: poses_visible, poses_thermal; what else "
                                    "lies there stays: measurements.json, mine"));
  EXPECT_TRUE(fs::exists(out / "mine/stage.json"));
  EXPECT_FALSE(fs::exists(out / "poses_thermal")) << "would be taken for this session's";
  EXPECT_EQ(states(run({}, {}, "poses")).at("poses_visible"), "unchanged");
}

TEST_F(Run, ASessionThatMovedOrWasCopiedGoesOn) {
  write_fixture_session(session, {.thermal = few_thermal});
  ASSERT_EQ(run({}, {}, "poses").code, 0);
  const fs::path first = session;
  session = temp.path() / "copy";
  fs::copy(first, session, fs::copy_options::recursive);
  const Outcome copied = run({}, {}, "poses");
  EXPECT_EQ(copied.code, 0) << copied.err;
  EXPECT_EQ(states(copied).at("poses_thermal"), "unchanged");
  const fs::path truth = temp.path() / "truth.json";
  ASSERT_TRUE(write_file_atomic(truth, R"({"visible": {"K": {"w": 64, "h": 48, "fx": 60, "fy": 60,
      "cx": 32, "cy": 24}, "frames": [{"file": "of/another/scene.jpg",
      "c2w": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}})"));
  const auto eval = [&](const fs::path& of) {
    return orbitfuse_program(
        {"eval", of.string(), "--out", out.string(), "--ground-truth", truth.string()});
  };
  EXPECT_THAT(eval(first).err, testing::Not(HasSubstr("holds results of")));
  const fs::path other = temp.path() / "other";
  write_fixture_session(other, {.thermal = 0});
  EXPECT_THAT(eval(other).err, HasSubstr("holds results of another session, " + session.string()));

  // Of a version that noted no id: by what the stages were made of.
  json old = json::parse(*read_file(out / "run.json"));
  old.erase("session_id");
  old["session"] = (temp.path() / "gone").string();
  std::ofstream(out / "run.json") << old.dump();
  EXPECT_EQ(run({}, {}, "poses").code, 0);

  // No result is at stake.
  fs::create_directories(temp.path() / "empty");
  out = temp.path() / "empty";
  std::ofstream(out / "run.json") << R"({"schema": 1, "session": "/elsewhere/car", "stages": []})";
  EXPECT_EQ(run({"--dry-run"}).code, 0);
}

TEST_F(Run, FilesOfPosesAreFoundFromAFolderThatIsALink) {
  write_fixture_session(session, {.thermal = few_thermal});
  fs::create_directories(temp.path() / "far" / "away" / "results");
  fs::create_directory_symlink(temp.path() / "far" / "away" / "results", out);
  ASSERT_EQ(run({}, {}, "poses").code, 0);
  for (const char* stage : {"poses_visible", "poses_thermal"}) {
    const auto transforms = read_transforms_json(out / stage / "transforms.json");
    ASSERT_TRUE(transforms);
    for (const TransformsFrame& frame : transforms->frames)
      EXPECT_TRUE(fs::exists(out / stage / frame.file_path)) << frame.file_path;
  }
}

TEST_F(Run, GivenCamerasAreRenderedAsGiven) {
  write_fixture_session(session, {.thermal = few_thermal});
  ASSERT_EQ(run({}, {}, "poses").code, 0);
  auto cameras = read_transforms_json(out / "poses_visible/transforms.json");
  ASSERT_TRUE(cameras);
  cameras->frames.resize(1);
  cameras->frames[0].file_path = "images/front.jpg";
  cameras->frames[0].camera = cameras->frames[0].camera.scaled_to(40, 30);
  ASSERT_TRUE(write_transforms_json(temp.path() / "cameras.json", *cameras));
  const Outcome outcome = run({"--cameras", (temp.path() / "cameras.json").string()}, {}, "render");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const fs::path shown =
      out / "render/visible" /
      fs::path(cameras->frames[0].file_path).filename().replace_extension(".png");
  const auto image = read_visible(shown);
  ASSERT_TRUE(image);
  EXPECT_EQ(image->cols, 40);
  // Whatever comes after keeps them, a failed call too, until other views are asked for.
  EXPECT_EQ(run({"--cameras", "/none.json"}, {}, "render").code, 3);
  ASSERT_EQ(run({}, {}, "fuse").code, 0);
  EXPECT_EQ(read_visible(shown)->cols, 40);
  ASSERT_EQ(run({"--views", "2"}, {}, "render").code, 0);
  EXPECT_TRUE(fs::exists(out / "render/visible/001.png"));
  EXPECT_FALSE(fs::exists(shown));
  const Rigid3d turned{Eigen::Quaterniond(Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY())),
                       {0, 0, 0}};
  cameras->frames[0].cam_from_world = turned * cameras->frames[0].cam_from_world;
  ASSERT_TRUE(write_transforms_json(temp.path() / "away.json", *cameras));
  const Outcome away = run({"--cameras", (temp.path() / "away.json").string()}, {}, "render");
  EXPECT_EQ(away.code, 0) << away.err;
  EXPECT_THAT(away.err, HasSubstr("new views"));
  EXPECT_THAT(away.err, HasSubstr("the world of OUT/poses_visible/transforms.json"));
  EXPECT_THAT(orbitfuse_program({"inspect", out.string()}).err, HasSubstr("render: new views"));
  cameras->frames[0].camera = cameras->frames[0].camera.scaled_to(1000000, 1000000);
  ASSERT_TRUE(write_transforms_json(temp.path() / "huge.json", *cameras));
  const Outcome huge = run({"--cameras", (temp.path() / "huge.json").string()}, {}, "render");
  EXPECT_EQ(huge.code, 3);
  EXPECT_THAT(huge.err, HasSubstr("huge.json: frames[0]"));
}

TEST_F(Run, JsonStreamIsOneObjectALineAndEndsWithTheResult) {
  write_fixture_session(session, {.thermal = few_thermal});
  const Outcome outcome = run({}, {}, "poses");
  const auto events = outcome.events();  // throws on a line that isn't JSON
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.back().at("event"), "result");
  EXPECT_EQ(events.back().at("ok"), true);
  int stages = 0;
  for (const auto& event : events) stages += event.at("event") == "stage";
  EXPECT_GE(stages, 2);
}

TEST_F(Run, WhereNobodySeesABarItSaysWhatBegins) {
  write_fixture_session(session, {.thermal = few_thermal});
  EXPECT_NE(run({}, {}, "poses").err.find("poses_visible  starts: not done yet"),
            std::string::npos);
}

TEST_F(Run, InterruptedTrainingResumesToTheSameField) {
  write_fixture_session(session);
  const std::vector<std::string> longer = {"--set", "train.visible.iterations=400", "--set",
                                           "train.visible.eval_count=4"};
  const Outcome stopped = run(longer, {.interrupt_after = "\"stage\":\"train.visible\""}, "train");
  if (stopped.code == 0) GTEST_SKIP() << "the training was over before the signal arrived";
  EXPECT_EQ(stopped.code, 130) << stopped.err;
  EXPECT_EQ(stopped.err.find("failed"), std::string::npos) << stopped.err;
  EXPECT_FALSE(fs::exists(out / "train_visible"));
  EXPECT_TRUE(fs::exists(out / "poses_visible/stage.json"));
  auto resume = longer;
  resume.push_back("--resume");
  ASSERT_EQ(run(resume, {}, "train").code, 0);
  const auto resumed = file_hash(out / "train_visible/field.bin");
  ASSERT_TRUE(resumed);
  fs::remove_all(out);
  ASSERT_EQ(run(longer, {}, "train").code, 0);
  const auto unbroken = file_hash(out / "train_visible/field.bin");
  ASSERT_TRUE(unbroken);
  EXPECT_EQ(*resumed, *unbroken);
}

}  // namespace
}  // namespace orbitfuse
