// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/run_planner.hpp"

#include <gtest/gtest.h>

#include "app/stages/build_stages.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::planning {
namespace {
using nlohmann::json;
using pipeline::StageState;
using pipeline::StageStatus;

class RunPlannerTest : public testing::Test {
 protected:
  PlannerInput input(double budget_s = 120) {
    PlannerInput planned;
    planned.budget_s = budget_s;
    planned.facts.visible_views = planned.facts.thermal_views = 24;
    planned.stages = stages::stage_names();
    planned.session_content = "this one";
    planned.elapsed_s = [this] { return clock_s; };
    return planned;
  }
  RunPlanner planner(PlannerInput with) {
    clock_s = 0;
    return {std::move(with), temp.path(), config};
  }
  RunPlanner planner(double budget_s = 120) { return planner(input(budget_s)); }

  static StageStatus status_of(const std::string& stage, double wall_s) {
    StageStatus status;
    status.stage = stage;
    status.state = StageState::ran;
    status.wall_s = wall_s;
    return status;
  }
  /// A run's stages before `last`, each as long as expected times `slower`.
  std::vector<StageStatus> run(RunPlanner& by, const std::string& last, double slower = 1) {
    std::vector<StageStatus> finished;
    for (const std::string& stage : stages::stage_names()) {
      warnings += by.decide(stage, finished);
      if (stage == last) break;
      finished.push_back(
          status_of(stage, slower * stage_s(stage, input().facts, by.first().effort)));
      clock_s += finished.back().wall_s;
    }
    return finished;
  }
  double training_s() const {
    return config.train_visible.options.budget_s + config.train_thermal.options.budget_s;
  }
  json settings() { return config.settings().to_json(); }

  test::TempFolder temp;
  stages::RunConfig config;
  double clock_s = 0;
  std::string warnings;
};

TEST_F(RunPlannerTest, DividesTheBudgetAndSettlesTheConfiguration) {
  RunPlanner by = planner();
  EXPECT_TRUE(by.first().fits);
  EXPECT_NE(by.described().find("expected"), std::string::npos);
  run(by, "metrics");
  EXPECT_GT(config.train_visible.options.budget_s, 0);
  EXPECT_GT(config.train_thermal.options.budget_s, 0);
  EXPECT_EQ(config.train_visible.options.iterations, stages::unlimited_steps) << "the time ends it";
  EXPECT_TRUE(config.validate());
  EXPECT_EQ(warnings, "");
}

TEST_F(RunPlannerTest, StagesThatTakeLongerLeaveLessForTheOthers) {
  constexpr double tight_s = 88;  // steps are what time there is for: 5 s more buy other things
  RunPlanner as_expected = planner(tight_s);
  run(as_expected, "train_thermal");
  const double usual_s = config.train_thermal.options.budget_s;
  config = {};
  RunPlanner slow = planner(tight_s);
  run(slow, "train_thermal", 1.1);
  EXPECT_LT(config.train_thermal.options.budget_s, usual_s);
  config = {};
  RunPlanner quick = planner(tight_s);
  run(quick, "train_thermal", 0.9);
  EXPECT_GT(config.train_thermal.options.budget_s, usual_s);
}

TEST_F(RunPlannerTest, ABudgetThatStopsFittingOnTheWayIsWarnedOfOnce) {
  RunPlanner by = planner(100);
  ASSERT_TRUE(by.first().fits);
  std::vector<StageStatus> finished;
  by.decide("poses_visible", finished);
  finished.push_back(status_of("poses_visible", 70));
  clock_s = 70;
  std::string said;
  for (const char* stage : {"depth", "train_visible", "poses_thermal", "train_thermal"})
    said += by.decide(stage, finished);
  EXPECT_EQ(said.find("--budget"), 0u) << said;
  EXPECT_EQ(said.find("--budget"), said.rfind("--budget")) << said;
  EXPECT_FALSE(by.expects_to_hold());
}

TEST_F(RunPlannerTest, SecondsOfUnchangedStagesAreNotOfThisRun) {
  RunPlanner by = planner();
  auto finished = run(by, "train_thermal");
  const double usual_s = config.train_thermal.options.budget_s;
  config = {};
  RunPlanner again = planner();
  std::vector<StageStatus> before;
  for (StageStatus status : finished) {
    again.decide(status.stage, before);
    status.state = StageState::unchanged;
    status.wall_s = 500;  // on another day
    before.push_back(status);
  }
  again.decide("train_thermal", before);
  EXPECT_GT(config.train_thermal.options.budget_s, 0.9 * usual_s);
}

TEST_F(RunPlannerTest, AnExtendedTrainingTellsTheMachineByItsSteps) {
  RunPlanner by = planner();
  auto finished = run(by, "poses_thermal");
  const auto thermal_s = [&](double stage_wall_s) {
    config = {};
    RunPlanner again = planner();
    for (StageStatus& status : finished)
      if (status.stage == "train_visible") {
        status.wall_s = stage_wall_s;  // of the new steps alone
        status.output.metrics = {{"iterations", 20'000},
                                 {"train_wall_s", 20'000 * visible_step_s()}};
      }
    again.decide("train_thermal", finished);
    return config.train_thermal.options.budget_s;
  };
  EXPECT_NEAR(thermal_s(2), thermal_s(60), 0.01);
}

TEST_F(RunPlannerTest, WhatTheUserSetStays) {
  config.train_visible.options.iterations = 1000;
  config.train_thermal.options.budget_s = 30;
  config.render.detail.sources = 3;
  config.metrics.scored_views = 5;
  const json before = settings();
  RunPlanner by = planner(60);
  run(by, "report");
  EXPECT_EQ(settings(), before);
}

TEST_F(RunPlannerTest, WhatTheUserGaveStaysThoughItIsTheDefault) {
  PlannerInput with = input(60);
  with.given = {"train.visible.iterations", "train.thermal.iterations", "render.detail_sources",
                "metrics.scored_views"};
  const json before = settings();
  RunPlanner by = planner(std::move(with));
  run(by, "report");
  EXPECT_EQ(settings(), before);
}

TEST_F(RunPlannerTest, CalledAgainItDecidesAlikeWhateverTheMachineDoes) {
  {
    RunPlanner by = planner();
    ASSERT_TRUE(by.save(run(by, "report")));
  }
  const json before = settings();
  config = {};
  PlannerInput slower = input();
  slower.slowness = 1.7;
  RunPlanner again = planner(std::move(slower));
  EXPECT_NE(again.described().find("as before"), std::string::npos);
  run(again, "report", 1.3);
  EXPECT_EQ(settings(), before);
}

TEST_F(RunPlannerTest, WhatAPlanDependsOnMakesAnother) {
  {
    RunPlanner by = planner();
    ASSERT_TRUE(by.save(run(by, "report")));
  }
  const auto follows = [&](const std::function<void(PlannerInput&)>& change) {
    config = {};
    PlannerInput with = input();
    change(with);
    return planner(std::move(with)).described().find("as before") != std::string::npos;
  };
  EXPECT_TRUE(follows([](PlannerInput&) {}));
  EXPECT_FALSE(follows([](PlannerInput& with) { with.budget_s = 200; }));
  EXPECT_FALSE(follows([](PlannerInput& with) { with.session_content = "another"; }));
  EXPECT_FALSE(follows([](PlannerInput& with) { with.afresh = true; }));
  EXPECT_FALSE(follows([](PlannerInput& with) { with.facts.new_views = 200; }));
  EXPECT_FALSE(follows([](PlannerInput& with) { with.stages.pop_back(); }));
  EXPECT_FALSE(follows([](PlannerInput& with) { with.given = {"metrics.scored_views"}; }));
  EXPECT_FALSE(follows([](PlannerInput& with) { with.facts.depth_width_px = 320; }));
  EXPECT_FALSE(follows([&](PlannerInput&) { config.render.detail.sources = 2; }));
}

TEST_F(RunPlannerTest, ADamagedPlanIsNoPlan) {
  {
    RunPlanner by = planner();
    ASSERT_TRUE(by.save(run(by, "report")));
  }
  const json good = parse_json(*read_file(temp / plan_file));
  std::vector<std::string> texts = {"", "{", "[]", "null", R"({"made_for": 3})"};
  for (const json& choices :
       {json(7), json{{"metrics.scored_views", "x"}}, json{{"metrics.scored_views", -4}},
        json{{"metrics.scored_views", 1e300}}, json{{"render.detail_sources", -1}},
        json{{"train.visible.budget_s", -3}}, json{{"train.visible.budget_s", {{"a", 1}}}},
        json{{"poses.colmap", "/bin/sh"}}, json{{"a~b", 1}}}) {
    json bad = good;
    bad["choices"] = choices;
    texts.push_back(bad.dump());
  }
  for (const char* key : {"plan", "expected_total_s"}) {
    json bad = good;
    bad[key] = "x";
    texts.push_back(bad.dump());
  }
  const stages::RunConfig usual;
  for (const std::string& text : texts) {
    ASSERT_TRUE(write_file_atomic(temp / plan_file, text));
    config = {};
    RunPlanner by = planner();
    run(by, "report");
    EXPECT_TRUE(config.validate()) << text;
    EXPECT_EQ(config.poses.colmap, usual.poses.colmap) << text;
    EXPECT_GT(config.train_visible.options.budget_s, 0) << text;
  }
}

TEST_F(RunPlannerTest, TellsOnlyOfStagesThatComeAndErrorsThatAreMeasured) {
  PlannerInput depth_alone = input();
  depth_alone.stages = {"poses_visible", "depth"};
  const std::string depth = planner(std::move(depth_alone)).described();
  EXPECT_EQ(depth.find("field"), std::string::npos) << depth;
  EXPECT_EQ(depth.find("dB"), std::string::npos) << depth;
  PlannerInput gray = input();
  gray.facts.thermal_measured = false;
  const std::string without_kelvin = planner(std::move(gray)).described();
  EXPECT_EQ(without_kelvin.find(" K"), std::string::npos) << without_kelvin;
  EXPECT_NE(without_kelvin.find("dB"), std::string::npos) << without_kelvin;
}

TEST_F(RunPlannerTest, TellsWhatWasExpectedAndWhatCame) {
  RunPlanner by = planner();
  auto finished = run(by, "report");
  for (StageStatus& status : finished) {
    if (status.stage == "train_visible") status.output.metrics["heldout_psnr_db"] = 24.5;
    if (status.stage == "metrics") status.output.metrics["thermal_heldout_field_mae_k"] = 0.625;
  }
  ASSERT_TRUE(by.save(finished));
  const std::string text = *read_file(temp / plan_file);
  EXPECT_NE(text.find("24.5 dB"), std::string::npos);
  EXPECT_NE(text.find("0.62 K"), std::string::npos);
  const json plan = parse_json(text);
  for (const char* list : {"rows", "columns"})
    for (const json& row : plan.at("table").at(list)) ASSERT_TRUE(row.is_array()) << list;
}

}  // namespace
}  // namespace orbitfuse::planning
