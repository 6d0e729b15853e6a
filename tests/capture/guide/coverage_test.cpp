// SPDX-License-Identifier: BSD-3-Clause
#include "capture/guide/coverage.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace orbitfuse {
namespace {

FrameAssessment good_frame(double azimuth_deg, double elevation_deg,
                           Modality modality = Modality::visible) {
  FrameAssessment frame;
  frame.modality = modality;
  frame.file = "visible/000001.jpg";
  frame.position = OrbitPosition{azimuth_deg, elevation_deg, 0.2, 0.1};
  frame.sharpness = 0.9;
  return frame;
}

TEST(Coverage, AngleDifferenceWraps) {
  EXPECT_DOUBLE_EQ(angle_difference_deg(350, 10), -20);
  EXPECT_DOUBLE_EQ(angle_difference_deg(10, 350), 20);
  EXPECT_DOUBLE_EQ(angle_difference_deg(-725, 0), -5);
  EXPECT_DOUBLE_EQ(angle_difference_deg(180, 0), -180);
}

TEST(Coverage, FillsTheSectorAcrossNorth) {
  Coverage coverage({});
  EXPECT_EQ(coverage.sectors().size(), 36u);
  EXPECT_EQ(coverage.add(good_frame(356, 12)), Refusal::none);
  EXPECT_TRUE(coverage.sectors()[0].done(Modality::visible));
  EXPECT_FALSE(coverage.sectors()[0].done(Modality::thermal));
}

TEST(Coverage, NoFalseGreen) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    Refusal expected;
    std::function<void(FrameAssessment&)> spoil;
  };
  const std::vector<Case> cases{
      {Refusal::not_on_disk, [](auto& f) { f.file.clear(); }},
      {Refusal::nuc, [](auto& f) { f.nuc = true; }},
      {Refusal::lost, [](auto& f) { f.position.reset(); }},
      {Refusal::position_unsure, [](auto& f) { f.position->sigma_deg = 3; }},
      {Refusal::position_unsure, [&](auto& f) { f.position->sigma_deg = nan; }},
      {Refusal::moving, [](auto& f) { f.position->speed_deg_s = -5; }},
      {Refusal::moving, [&](auto& f) { f.position->speed_deg_s = nan; }},
      {Refusal::blurred, [](auto& f) { f.sharpness = 0.2; }},
      {Refusal::blurred, [&](auto& f) { f.sharpness = nan; }},
      {Refusal::blurred,
       [](auto& f) {
         f.edge_blur = EdgeBlur{1.8, 100};
       }},
      {Refusal::blurred,
       [&](auto& f) {
         f.edge_blur = EdgeBlur{nan, 100};
       }},
      {Refusal::blurred,
       [](auto& f) {
         f.edge_blur = EdgeBlur{3.3, 100};
         f.modality = Modality::thermal;
       }},
      {Refusal::featureless,
       [](auto& f) {
         f.edge_blur = EdgeBlur{0, 0};
       }},
      {Refusal::badly_exposed, [](auto& f) { f.underexposed = 0.6; }},
      {Refusal::between_stations, [](auto& f) { f.position->azimuth_deg = 15; }},
      {Refusal::between_stations, [&](auto& f) { f.position->azimuth_deg = nan; }},
      {Refusal::out_of_band, [](auto& f) { f.position->elevation_deg = 20; }},
      {Refusal::out_of_band, [&](auto& f) { f.position->elevation_deg = nan; }}};
  for (const Case& c : cases) {
    Coverage coverage({});
    FrameAssessment frame = good_frame(0, 10);
    c.spoil(frame);
    EXPECT_EQ(coverage.add(frame), c.expected) << text(c.expected);
    EXPECT_EQ(coverage.done_count(Modality::visible) + coverage.done_count(Modality::thermal), 0)
        << text(c.expected);
  }
}

TEST(Coverage, ThermalEdgesMayBeWider) {
  Coverage coverage({});
  FrameAssessment frame = good_frame(0, 10, Modality::thermal);
  frame.edge_blur = EdgeBlur{2.5, 100};
  EXPECT_EQ(coverage.add(frame), Refusal::none);
  frame.modality = Modality::visible;
  EXPECT_EQ(coverage.add(frame), Refusal::blurred);
  CoverageOptions options;
  options.max_visible_edge_px = 3;
  EXPECT_EQ(Coverage({}, options).add(frame), Refusal::none);
  options.max_visible_edge_px = 0;
  EXPECT_EQ(options.validate().error().where, "guide.max_visible_edge_px");
}

TEST(Coverage, KeepsTheSharpest) {
  Coverage coverage({});
  FrameAssessment frame = good_frame(30, 10);
  coverage.add(frame);
  frame.file = "visible/sharper.jpg";
  frame.sharpness = 0.95;
  coverage.add(frame);
  frame.file = "visible/softer.jpg";
  frame.sharpness = 0.6;
  coverage.add(frame);
  EXPECT_EQ(coverage.sectors()[1].best.at(Modality::visible).file, "visible/sharper.jpg");
}

TEST(Coverage, CompleteNeedsEveryModality) {
  OrbitPlan plan;
  plan.loop_elevations_deg = {20};
  Coverage coverage(plan);
  for (int i = 0; i < 12; ++i) coverage.add(good_frame(30 * i + 4, 20));
  EXPECT_EQ(coverage.done_count(Modality::visible), 12);
  EXPECT_FALSE(coverage.complete());
  for (int i = 0; i < 12; ++i) coverage.add(good_frame(30 * i - 4, 25, Modality::thermal));
  EXPECT_TRUE(coverage.complete());
  EXPECT_EQ(coverage.instruction(Modality::visible, OrbitPosition{}), "visible: done");
}

TEST(Coverage, SaysWhereToGo) {
  OrbitPlan plan;
  plan.loop_elevations_deg = {10, 40};
  Coverage coverage(plan);
  EXPECT_EQ(coverage.instruction(Modality::visible, std::nullopt), "show the mat to the camera");
  EXPECT_EQ(coverage.instruction(Modality::visible, OrbitPosition{12, 1, 0, 0}),
            "12° further left, 9° higher");
  EXPECT_EQ(coverage.instruction(Modality::visible, OrbitPosition{348, 10, 0, 0}),
            "12° further right");
  EXPECT_EQ(coverage.instruction(Modality::visible, OrbitPosition{1, 10, 0, 0}, Refusal::blurred),
            "blurred, hold still");
  for (int i = 0; i < 12; ++i) coverage.add(good_frame(30 * i, 10));
  EXPECT_EQ(coverage.instruction(Modality::visible, OrbitPosition{0, 10, 0, 0}), "30° higher");
}

TEST(Coverage, PlansAreValidatedByField) {
  OrbitPlan plan;
  plan.spacing_deg = 50;  // does not divide 360
  EXPECT_NE(plan.validate().error().where.find("spacing_deg"), std::string::npos);
  plan = {};
  plan.loop_elevations_deg = {10, 15};  // bands overlap
  EXPECT_FALSE(plan.validate());
  plan = {};
  plan.azimuth_tolerance_deg = 20;
  EXPECT_FALSE(plan.validate());
  EXPECT_TRUE(OrbitPlan{}.validate());
}

}  // namespace
}  // namespace orbitfuse
