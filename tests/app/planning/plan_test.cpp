// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/plan.hpp"
#include "app/planning/machine_speed.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "app/stages/build_stages.hpp"

namespace orbitfuse::planning {
namespace {

SceneFacts usual_orbit() {
  SceneFacts facts;
  facts.visible_views = facts.thermal_views = 24;
  return facts;
}

double needed_s(const SceneFacts& facts, const Effort& effort) {
  double sum = 0;
  for (const std::string& stage : stages::stage_names()) sum += stage_s(stage, facts, effort);
  return sum;
}

TEST(StageCosts, MoreOfAnythingTakesLonger) {
  const SceneFacts facts = usual_orbit();
  const double usual = needed_s(facts, {});
  for (const Effort& more : {Effort{.visible_steps = 6000}, Effort{.thermal_steps = 3000}})
    EXPECT_GT(needed_s(facts, more), usual);
  EXPECT_LT(needed_s(facts, {.scored_views = 2}), usual);
  EXPECT_LT(needed_s(facts, {.detail = false}), usual);
  SceneFacts larger = facts;
  larger.visible_views = 40;
  EXPECT_GT(needed_s(larger, {}), usual);
  SceneFacts finer = facts;
  finer.depth_width_px = 400;
  EXPECT_GT(needed_s(finer, {}), usual);
  larger.visible_posed = larger.thermal_posed = true;
  EXPECT_LT(needed_s(larger, {}), usual) << "poses that are known cost nothing";
}

TEST(StageCosts, FieldsInFramesOfTheirOwnAreRegisteredAndThermalOnesAloneMatchDepth) {
  SceneFacts facts = usual_orbit();
  EXPECT_EQ(stage_s("register", facts, {}), 0) << "thermal views were posed in the visible scene";
  facts.visible_posed = facts.thermal_posed = true;
  EXPECT_GT(stage_s("register", facts, {}), 0);
  const double with_photos = stage_s("train_thermal", facts, {});
  facts.visible_views = 0;
  EXPECT_GT(stage_s("train_thermal", facts, {}), with_photos);
}

TEST(ErrorCurves, ScenesWithoutAnyDetailArePromisedNoMoreThanTheSmoothestThatWasSeen) {
  SceneFacts facts = usual_orbit();
  facts.smoothness_db = 80;
  EXPECT_LT(expected_errors(facts, {}).visible_psnr_db, 32);
  facts.smoothness_db = -20;
  EXPECT_GT(expected_errors(facts, {}).visible_psnr_db, 20);
}

TEST(StageCosts, AModalityThatIsNotThereCostsNothing) {
  SceneFacts facts = usual_orbit();
  facts.thermal_views = 0;
  EXPECT_EQ(stage_s("poses_thermal", facts, {}), 0);
  EXPECT_EQ(stage_s("train_thermal", facts, {}), 0);
  EXPECT_EQ(stage_s("fuse", facts, {}), 0);
  facts.visible_views = 0;
  for (const char* stage : {"poses_visible", "depth", "train_visible"})
    EXPECT_EQ(stage_s(stage, facts, {}), 0) << stage;
}

TEST(ErrorCurves, MoreStepsNeverExpectALargerError) {
  const SceneFacts facts = usual_orbit();
  Effort effort{.visible_steps = 1, .thermal_steps = 1};
  double last = std::numeric_limits<double>::infinity();
  for (int steps = 1; steps < 1'000'000; steps *= 2) {
    for (int* of : {&effort.visible_steps, &effort.thermal_steps}) {
      *of = steps;
      const double now = loss(facts, effort);
      ASSERT_TRUE(std::isfinite(now));
      EXPECT_LE(now, last) << steps;
      last = now;
    }
  }
}

TEST(Plan, UsesWhatThereIsAndNoMore) {
  const SceneFacts facts = usual_orbit();
  double last_loss = std::numeric_limits<double>::infinity();
  for (const double slowness : {0.5, 1.0, 2.0}) {
    last_loss = std::numeric_limits<double>::infinity();
    for (double available_s = 100; available_s < 400; available_s += 20) {
      const Plan plan = make_plan(facts, stages::stage_names(), {}, slowness, available_s);
      if (!plan.fits) {
        EXPECT_TRUE(std::isinf(last_loss)) << "more time, and suddenly too little";
        continue;
      }
      EXPECT_LE(plan.expected_s, available_s);
      EXPECT_NEAR(plan.expected_s, slowness * needed_s(facts, plan.effort), 1e-6);
      EXPECT_TRUE(!plan.all_used || plan.expected_s >= 0.95 * available_s) << available_s;
      const double now = loss(facts, plan.effort);
      EXPECT_LE(now, last_loss + 1e-9) << available_s;
      last_loss = now;
    }
    EXPECT_TRUE(std::isfinite(last_loss));
  }
}

TEST(Plan, TooLittleTimeIsSaidAndGetsWhatEndsSoonest) {
  const SceneFacts facts = usual_orbit();
  for (const double available_s : {10.0, 0.0, -5.0, -std::numeric_limits<double>::infinity()}) {
    const Plan plan = make_plan(facts, stages::stage_names(), {}, 1, available_s);
    EXPECT_FALSE(plan.fits);
    EXPECT_EQ(plan.effort.thermal_steps, least_effort.thermal_steps);
    Effort other = least_effort;
    for (other.visible_steps = least_effort.visible_steps; other.visible_steps < 10'000;
         other.visible_steps += 100)
      EXPECT_LE(plan.expected_s, needed_s(facts, other) + 0.05) << other.visible_steps;
    EXPECT_LT(plan.expected_s, needed_s(facts, least_effort)) << "fog costs more than it saves";
    EXPECT_GT(plan.expected_s, available_s);
  }
}

TEST(StageSlowness, GrowsWithAStepsAndLessAboutTheReference) {
  EXPECT_DOUBLE_EQ(stage_slowness(1), 1);
  EXPECT_NEAR(stage_slowness(1.59), 1.26, 0.01);
  EXPECT_NEAR(stage_slowness(8) / stage_slowness(4), 2, 1e-9) << "a slow machine is slow in all";
  EXPECT_NEAR(stage_slowness(0.1) / stage_slowness(0.2), 0.5, 1e-9);
  for (double step = 0.1; step < 10; step *= 1.01)
    EXPECT_LT(stage_slowness(step), stage_slowness(1.01 * step)) << step;
}

TEST(Plan, EndlessTimeIsNotSpent) {
  const Plan plan = make_plan(usual_orbit(), stages::stage_names(), {}, 1, 1e6);
  EXPECT_TRUE(plan.fits);
  EXPECT_FALSE(plan.all_used);
  EXPECT_LT(plan.expected_s, 1000);
}

TEST(Plan, DetailGoesWhereTimeIsShortAndComesBackWithIt) {
  const SceneFacts facts = usual_orbit();
  const double least_s = make_plan(facts, stages::stage_names(), {}, 1, 0).expected_s;
  const Plan tight = make_plan(facts, stages::stage_names(), {}, 1, least_s + 1);
  EXPECT_TRUE(tight.fits);
  EXPECT_FALSE(tight.effort.detail);
  EXPECT_TRUE(make_plan(facts, stages::stage_names(), {}, 1, needed_s(facts, {})).effort.detail);
  const Plan kept = make_plan(facts, stages::stage_names(), {.detail = true}, 1, 0);
  EXPECT_TRUE(kept.effort.detail);
  EXPECT_GT(kept.expected_s, least_s);
}

TEST(ErrorCurves, WhereNoFrameLendsDetailNoneIsMissed) {
  SceneFacts facts = usual_orbit();
  EXPECT_GT(loss(facts, {.detail = false}), loss(facts, {}));
  EXPECT_DOUBLE_EQ(expected_errors(facts, {.detail = false}).thermal_mae_k,
                   expected_errors(facts, {}).thermal_mae_k)
      << "what is told is the fields'";
  facts.detail_sources = 0;
  EXPECT_DOUBLE_EQ(loss(facts, {.detail = false}), loss(facts, {}));
}

TEST(Plan, WhatIsSettledStays) {
  const Settled settled{.visible_steps = 1234, .scored_views = 0};
  for (const double available_s : {20.0, 120.0, 300.0}) {
    const Plan plan = make_plan(usual_orbit(), stages::stage_names(), settled, 1, available_s);
    EXPECT_EQ(plan.effort.visible_steps, 1234);
    EXPECT_EQ(plan.effort.scored_views, 0);
  }
}

TEST(Plan, OneModalityGetsAllTheTraining) {
  SceneFacts facts = usual_orbit();
  facts.thermal_views = 0;
  const Plan visible = make_plan(facts, stages::stage_names(), {}, 1, 60);
  EXPECT_TRUE(visible.fits);
  EXPECT_GE(visible.expected_s, 57);
  facts = usual_orbit();
  facts.visible_views = 0;
  const Plan thermal = make_plan(facts, stages::stage_names(), {}, 1, 60);
  EXPECT_TRUE(thermal.fits);
  EXPECT_GT(thermal.effort.thermal_steps, 2400);
}

TEST(Plan, OfTheLastStagesOnlyThoseAreCounted) {
  const std::vector<std::string> rest = {"train_thermal", "render", "fuse", "metrics", "report"};
  const Plan plan = make_plan(usual_orbit(), rest, {.visible_steps = 4800}, 1, 60);
  EXPECT_TRUE(plan.fits);
  EXPECT_EQ(plan.effort.visible_steps, 4800);
  EXPECT_GT(plan.effort.thermal_steps, 2400) << "the rest is the thermal field's";
  const Plan nothing = make_plan(usual_orbit(), {}, {}, 1, 60);
  EXPECT_EQ(nothing.expected_s, 0);
}

}  // namespace
}  // namespace orbitfuse::planning
