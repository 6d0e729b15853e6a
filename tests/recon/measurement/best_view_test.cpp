// SPDX-License-Identifier: BSD-3-Clause
// Which frame sees a place best, what its temperature was computed with, and how both are kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "recon/measurement/measure.hpp"
#include "recon/measurement/reradiometry.hpp"
#include "recon/measurement/table.hpp"
#include "tests/recon/measurement/box_orbit.hpp"

namespace orbitfuse::measurement {
namespace {
using namespace testing_box;
using nlohmann::json;
using testing::HasSubstr;

/// Of the frames that see the point: the one whose pixels are finest on its surface.
std::string finest(const ThermalScene& scene, const Answer& answer) {
  std::string name;
  double most = 0;
  for (const ThermalFrame& frame : scene.frames()) {
    const auto sees =
        std::any_of(answer.reading.frames.begin(), answer.reading.frames.end(),
                    [&](const FrameLine& line) { return line.frame == frame.view.name; });
    const Eigen::Vector3d to = camera_center(frame.view.cam_from_world) - *answer.position;
    const double depth = (frame.view.cam_from_world * *answer.position).z();
    const double fine = to.normalized().dot(*answer.normal) / depth;
    if (sees && fine > most) most = fine, name = frame.view.name;
  }
  return name;
}

TEST(BestView, IsTheOneThatSeesThePlaceFinest) {
  const ThermalScene scene = box_orbit();
  const Answer answer = ask(scene, spot_at({0.4, 0.02, 0.01}));
  const FrameLine* best = answer.reading.best();
  ASSERT_NE(best, nullptr);
  EXPECT_EQ(best->frame, finest(scene, answer));
  EXPECT_THAT(described(answer.reading), HasSubstr("best seen at " + best->frame + ","));
  // A camera nearer, as straight, is better: half the distance, twice the pixels.
  SceneParts parts = box_parts();
  ThermalFrame near = parts.frames.front();
  for (const ThermalFrame& frame : parts.frames)
    if (frame.view.name == best->frame) near = frame;
  near.view.name = "near";
  const Eigen::Vector3d center = camera_center(near.view.cam_from_world);
  const Eigen::Vector3d moved = *answer.position + 0.5 * (center - *answer.position);
  near.view.cam_from_world.translation = -(near.view.cam_from_world.rotation * moved);
  parts.frames.push_back(near);
  const Answer closer = ask(box_orbit(parts), spot_at({0.4, 0.02, 0.01}));
  ASSERT_EQ(closer.reading.best()->frame, "near");
  EXPECT_NEAR(closer.reading.best()->pixels_per_unit / best->pixels_per_unit, 2, 0.2);
  // A doubtful pose is only taken where there is no other.
  parts.frames.back().doubt = "no neighbour agrees";
  const Answer doubted = ask(box_orbit(std::move(parts)), spot_at({0.4, 0.02, 0.01}));
  EXPECT_EQ(doubted.reading.best()->frame, best->frame);
}

TEST(BestView, OfARegionItIsOneThatSeesMostOfIt) {
  Request box;
  box.kind = Kind::box;
  box.box.center = {0.4, 0, 0};
  box.box.size = {0.1, 0.3, 0.3};
  const Answer answer = ask(box_orbit(), box);
  const FrameLine* best = answer.reading.best();
  ASSERT_NE(best, nullptr);
  EXPECT_GT(best->covered, 0.5);
  EXPECT_TRUE(std::isfinite(best->pixels_per_unit));
}

TEST(BestView, WhatNoFrameSeesHasNone) {
  EXPECT_EQ(TemperatureReading{}.best(), nullptr);
  // Of an earlier version, without the fineness: the straightest.
  TemperatureReading old;
  const Eigen::Vector2d anywhere(1, 1);
  old.frames = {{.frame = "flat", .pixel = anywhere, .angle_deg = 60},
                {.frame = "straight", .pixel = anywhere, .angle_deg = 10}};
  EXPECT_EQ(old.best()->frame, "straight");
  old.frames = {{.frame = "unknown", .pixel = anywhere}};
  EXPECT_EQ(old.best()->frame, "unknown") << "nothing is known of it, and it is the only one";
}

TEST(UsedParameters, AreTheRecordedOnesUnlessOthersAreAsked) {
  SceneParts parts = box_parts();
  FlirCalibration made;
  made.planck = {.r1 = 17000, .r2 = 0.02, .b = 1430, .f = 1, .o = -7000};
  made.object.emissivity = 0.95;
  made.object.reflected_k = 293.15;
  for (ThermalFrame& frame : parts.frames) frame.radiometry = made;
  EXPECT_EQ(used_parameters(parts.frames, {}, {}).words,
            "emissivity 0.95 as recorded, reflected temperature 20.0 C as recorded");
  EXPECT_EQ(used_parameters(parts.frames, {}, {}).emissivity, 0.95);
  ObjectParameterOverrides asked;
  asked.emissivity = 0.6;
  EXPECT_THAT(used_parameters(parts.frames, asked, {}).words, HasSubstr("0.60 as asked"));
  parts.frames.front().radiometry->object.emissivity = 0.9;
  const UsedParameters unlike = used_parameters(parts.frames, {}, {});
  EXPECT_THAT(unlike.words, HasSubstr("0.90 to 0.95 as recorded"));
  EXPECT_TRUE(std::isnan(unlike.emissivity));
  parts.frames.front().radiometry.reset();
  EXPECT_THAT(used_parameters(parts.frames, {}, {}).words,
              HasSubstr("emissivity 0.95 as recorded in 23 of 24 frames"));
  for (ThermalFrame& frame : parts.frames) frame.radiometry.reset();
  EXPECT_THAT(used_parameters(parts.frames, {}, {}).words, HasSubstr("not recorded"));
  ObjectParameterOverrides told;
  told.emissivity = 0.9;
  EXPECT_EQ(used_parameters(parts.frames, {}, told).words,
            "emissivity 0.90 as told of the recording, reflected temperature 20.0 C assumed");
  EXPECT_EQ(used_parameters({}, {}, {}).words, "");
  EXPECT_THAT(ask(box_orbit(), spot_at({0.4, 0.02, 0.01})).radiometry.words,
              HasSubstr("as the camera gave them"));
}

TEST(AnswerOfJson, IsWhatWasWritten) {
  const ThermalScene scene = box_orbit();
  Request hottest;
  hottest.kind = Kind::hottest;
  hottest.count = 2;
  Request difference;
  difference.kind = Kind::difference;
  difference.of = {spot_at({0.4, 0.02, 0.01}), spot_at({50, 0, 0})};
  difference.of[1].places = {Eigen::Vector3d(0, 0, 0)};  // inside: no frame sees it
  Request distance;
  distance.kind = Kind::distance;
  distance.places = {Eigen::Vector3d(0.4, 0.02, 0.01), Eigen::Vector3d(0.4, -0.05, 0.01)};
  for (const Request& request : {spot_at({0.4, 0.02, 0.01}), hottest, difference, distance}) {
    const json written = to_json(ask(scene, request));
    const auto read = answer_of_json(written);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(to_json(*read), written);
  }
}

TEST(AnswerOfJson, WhatHasAnotherTypeIsNamed) {
  const json good = to_json(ask(box_orbit(), spot_at({0.4, 0.02, 0.01})));
  for (const auto& [pointer, value, where] :
       {std::tuple("/reading/temperature_k", json("hot"), "answer.reading.temperature_k"),
        std::tuple("/reading/frames", json(5), "answer.reading.frames"),
        std::tuple("/reading/frames/0/used", json(1), "answer.reading.frames[0].used"),
        std::tuple("/reading/seen_points", json(1.5), "answer.reading.seen_points"),
        std::tuple("/point", json({1, 2}), "answer.point"),
        std::tuple("/kind", json("spit"), "answer.kind"),
        std::tuple("/notes", json({1}), "answer.notes"),
        std::tuple("/radiometry", json("x"), "answer.radiometry"),
        std::tuple("/spots", json({1}), "answer.spots[0]"),
        std::tuple("/of", json({{{"kind", "difference"}, {"of", {1}}}}), "answer.of[0].of")}) {
    json bad = good;
    bad[json::json_pointer(pointer)] = value;
    const auto read = answer_of_json(bad);
    ASSERT_FALSE(read) << pointer;
    EXPECT_EQ(read.error().kind, ErrorKind::input);
    EXPECT_EQ(read.error().where, where);
  }
  EXPECT_FALSE(answer_of_json(json::array()));
  EXPECT_TRUE(answer_of_json({{"kind", "spot"}})) << "what is absent is not known";
}

TEST(UnposedFrames, SayWhatToDo) {
  SceneParts parts = box_parts();
  parts.unposed = {"thermal/000099.tiff"};
  const auto view = box_orbit(std::move(parts)).view("thermal/000099.tiff");
  ASSERT_FALSE(view);
  EXPECT_THAT(view.error().found, HasSubstr("no pose"));
  EXPECT_THAT(view.error().remedy, HasSubstr("choose a posed view"));
}

}  // namespace
}  // namespace orbitfuse::measurement
