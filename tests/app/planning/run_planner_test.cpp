// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/run_planner.hpp"

#include <gtest/gtest.h>

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
  PlannerInput input(double budget_s = 120) const {
    PlannerInput planned;
    planned.budget_s = budget_s;
    planned.facts.visible_views = planned.facts.thermal_views = 24;
    planned.stages = planned_stages();
    planned.session_content = "this one";
    return planned;
  }
  RunPlanner planner(double budget_s = 120) {
    return {input(budget_s), temp.path(), config, false};
  }
  static StageStatus took(const std::string& stage, double wall_s, const json& metrics = {}) {
    StageStatus status;
    status.stage = stage;
    status.state = StageState::ran;
    status.wall_s = wall_s;
    if (metrics.is_object()) status.output.metrics = metrics;
    return status;
  }
  /// A run's stages up to `last`, each as long as expected times `slower`.
  std::vector<StageStatus> run(RunPlanner& by, const std::string& last, double slower) const {
    std::vector<StageStatus> finished;
    for (const std::string& stage : planned_stages()) {
      by.decide(stage, finished);
      if (stage == last) break;
      finished.push_back(took(stage, slower * stage_s(stage, input().facts, by.first().effort)));
    }
    return finished;
  }

  double training_s() const {
    return config.train_visible.options.budget_s + config.train_thermal.options.budget_s;
  }

  test::TempFolder temp;
  stages::RunConfig config;
};

TEST_F(RunPlannerTest, DividesTheBudgetAndSettlesTheConfiguration) {
  RunPlanner by = planner();
  EXPECT_TRUE(by.first().fits);
  EXPECT_NE(by.described().find("expected"), std::string::npos);
  run(by, "metrics", 1);
  EXPECT_GT(config.train_visible.options.budget_s, 0);
  EXPECT_GT(config.train_thermal.options.budget_s, 0);
  EXPECT_GT(config.train_visible.options.iterations,
            config.train_visible.options.budget_s / visible_step_s())
      << "the time ends it";
  EXPECT_TRUE(config.validate());
}

TEST_F(RunPlannerTest, StagesThatTakeLongerLeaveLessForTheOthers) {
  RunPlanner as_expected = planner();
  run(as_expected, "train_thermal", 1);
  const double usual_s = config.train_thermal.options.budget_s;
  config = {};
  RunPlanner slow = planner();
  run(slow, "train_thermal", 1.1);
  EXPECT_LT(config.train_thermal.options.budget_s, usual_s);
  config = {};
  RunPlanner quick = planner();
  run(quick, "train_thermal", 0.9);
  EXPECT_GT(config.train_thermal.options.budget_s, usual_s);
}

TEST_F(RunPlannerTest, WhatTheUserSetStays) {
  config.depth.width_px = 320;
  config.train_visible.options.iterations = 1000;
  config.metrics.scored_views = 5;
  RunPlanner by = planner(60);
  run(by, "report", 1);
  EXPECT_EQ(config.depth.width_px, 320);
  EXPECT_EQ(config.train_visible.options.iterations, 1000);
  EXPECT_EQ(config.train_visible.options.budget_s, 0);
  EXPECT_EQ(config.metrics.scored_views, 5);
}

TEST_F(RunPlannerTest, CalledAgainItDecidesAlikeWhateverTheMachineDoes) {
  {
    RunPlanner by = planner();
    const auto finished = run(by, "report", 1);
    ASSERT_TRUE(by.save(finished));
  }
  const json before = config.settings().to_json();
  // As run.json brings the options of the earlier run, and as a new call has its own defaults.
  for (const bool from_run_json : {true, false}) {
    if (!from_run_json) config = {};
    PlannerInput slower = input();
    slower.slowness = 1.7;
    RunPlanner again(std::move(slower), temp.path(), config, false);
    run(again, "report", 1.3);
    EXPECT_EQ(config.settings().to_json(), before);
  }
}

TEST_F(RunPlannerTest, AnotherBudgetOrSessionOrForceIsPlannedAfresh) {
  {
    RunPlanner by = planner();
    ASSERT_TRUE(by.save(run(by, "report", 1)));
  }
  const double before_s = training_s();
  // The configuration still holds what the first plan chose, as run.json brings it.
  RunPlanner longer = planner(200);
  run(longer, "report", 1);
  EXPECT_GT(training_s(), before_s);

  for (const bool forced : {true, false}) {
    config = {};
    PlannerInput other = input();
    other.slowness = 1.3;
    if (!forced) other.session_content = "another";
    RunPlanner by(std::move(other), temp.path(), config, forced);
    run(by, "report", 1.3);
    EXPECT_LT(training_s(), before_s);
  }
}

TEST_F(RunPlannerTest, ADamagedPlanIsNoPlan) {
  for (const char* text :
       {"", "{", "[]", R"({"schema": 9})", R"({"schema": "1"})",
        R"({"schema": 1, "choices": {}, "budget_s": "120", "session_content": 3})",
        R"({"schema": 1, "choices": 3})",
        R"({"schema": 1, "choices": {"depth": 7, "metrics": {"metrics.scored_views": "x"}},
            "budget_s": 120, "session_content": "this one"})"}) {
    ASSERT_TRUE(write_file_atomic(temp / plan_file, text));
    config = {};
    RunPlanner by = planner();
    run(by, "report", 1);
    EXPECT_TRUE(config.validate()) << text;
    EXPECT_GT(config.train_visible.options.budget_s, 0) << text;
  }
}

TEST_F(RunPlannerTest, TellsWhatWasExpectedAndWhatCame) {
  RunPlanner by = planner();
  auto finished = run(by, "report", 1);
  for (StageStatus& status : finished) {
    if (status.stage == "train_visible") status.output.metrics["heldout_psnr_db"] = 24.5;
    if (status.stage == "metrics") status.output.metrics["thermal_heldout_mae_k"] = 0.625;
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
