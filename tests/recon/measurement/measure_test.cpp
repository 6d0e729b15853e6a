// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/measure.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <thread>

#include "recon/measurement/table.hpp"
#include "tests/recon/measurement/box_orbit.hpp"

namespace orbitfuse::measurement {
namespace {
using namespace testing_box;
using testing::HasSubstr;

Answer ask(const ThermalScene& scene, const Request& request) {
  auto answer = measure(scene, request, {});
  EXPECT_TRUE(answer) << answer.error().message();
  return answer ? *std::move(answer) : Answer{};
}

std::set<std::string> frames_of(const TemperatureReading& reading) {
  std::set<std::string> names;
  for (const FrameLine& line : reading.frames) names.insert(line.frame);
  return names;
}

TEST(Measure, ASpotIsWhatTheFramesThatSeeItShow) {
  const ThermalScene scene = box_orbit();
  const Answer answer = ask(scene, spot_at({0.4, 0.02, 0.01}));
  EXPECT_NEAR(answer.reading.temperature_k, end_k, 1e-3);
  EXPECT_NEAR(answer.reading.field_k, end_k, 1e-3);
  EXPECT_NEAR(answer.reading.spread_k, 0, 1e-3);
  EXPECT_GT(answer.reading.uncertainty_k, 0);
  EXPECT_LT(answer.reading.uncertainty_k, 1);
  ASSERT_TRUE(answer.normal);
  EXPECT_GT(answer.normal->x(), 0.99);
  EXPECT_TRUE(answer.notes.empty());
  // Exactly the cameras in front of that end, not too flat to it.
  std::set<std::string> expected;
  for (const ThermalFrame& frame : scene.frames()) {
    const Eigen::Vector3d to =
        (camera_center(frame.view.cam_from_world) - *answer.position).normalized();
    if (std::acos(to.x()) < scene.options().max_angle_deg * M_PI / 180)
      expected.insert(frame.view.name);
  }
  EXPECT_GE(expected.size(), 4u);
  EXPECT_EQ(frames_of(answer.reading), expected);
  double weights = 0;
  for (const FrameLine& line : answer.reading.frames) weights += line.weight;
  EXPECT_NEAR(weights, 1, 1e-9);
}

TEST(Measure, WhatStandsInTheWayHidesTheSpot) {
  const ThermalScene scene = box_orbit();
  // On the large box's top, close behind the small box as cameras at +x see it.
  const Answer answer = ask(scene, spot_at({0.18, 0, 0.15}));
  EXPECT_THAT(answer.reading.hidden, HasSubstr("occluded"));
  for (const FrameLine& line : answer.reading.frames) {
    EXPECT_NEAR(line.mean_k, top_k, 0.5) << line.frame;
    const auto view = scene.view(line.frame);
    EXPECT_LT(camera_center((*view)->cam_from_world).x(), 1.5) << line.frame;
  }
  EXPECT_TRUE(answer.reading.seen());
}

TEST(Measure, APixelIsTheSurfaceThatItShows) {
  const ThermalScene scene = box_orbit();
  const PosedView& view = scene.frames()[0].view;
  const Eigen::Vector3d point(0.4, 0.02, 0.01);
  Request request;
  request.places = {PixelPlace{view.name, view.camera.project(view.cam_from_world * point)}};
  const Answer answer = ask(scene, request);
  ASSERT_TRUE(answer.position);
  EXPECT_LT((*answer.position - point).norm(), 1e-5);
  EXPECT_NEAR(answer.reading.temperature_k, end_k, 1e-3);
}

TEST(Measure, WhatNoFrameSeesSaysSo) {
  const ThermalScene scene = box_orbit();
  for (const Eigen::Vector3d& hidden : {Eigen::Vector3d(0, 0, -0.15), Eigen::Vector3d(0, 0, 0)}) {
    const Answer answer = ask(scene, spot_at(hidden));
    EXPECT_FALSE(answer.reading.seen());
    EXPECT_TRUE(std::isnan(answer.reading.temperature_k));
    EXPECT_TRUE(std::isnan(answer.reading.uncertainty_k));
    ASSERT_FALSE(answer.notes.empty());
    EXPECT_THAT(answer.notes[0], HasSubstr("no thermal frame sees it"));
    EXPECT_TRUE(to_json(answer)["reading"]["temperature_k"].is_null());
  }
}

TEST(Measure, APointOutsideOfTheSceneIsRefusedWithItsMiddle) {
  const ThermalScene scene = box_orbit();
  const auto answer = measure(scene, spot_at({50, 0, 0}), {});
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().kind, ErrorKind::input);
  EXPECT_THAT(answer.error().found, HasSubstr("outside of the scene"));
}

TEST(Measure, DoubtfulFramesCountForLess) {
  SceneParts parts = box_parts();
  const Answer sure = ask(box_orbit(box_parts()), spot_at({0.4, 0.02, 0.01}));
  const std::string doubted = sure.reading.frames[0].frame;
  for (ThermalFrame& frame : parts.frames)
    if (frame.view.name == doubted) frame.doubt = "temperatures place it elsewhere";
  const ThermalScene scene = box_orbit(std::move(parts));
  const Answer answer = ask(scene, spot_at({0.4, 0.02, 0.01}));
  for (std::size_t i = 0; i < answer.reading.frames.size(); ++i) {
    const FrameLine& line = answer.reading.frames[i];
    EXPECT_EQ(line.doubtful, line.frame == doubted);
    if (!line.doubtful) continue;
    EXPECT_LT(line.weight, 0.5 * sure.reading.frames[i].weight);
  }
}

TEST(Measure, AFrameThatIsOffCountsAsSpreadAndDoesNotDecide) {
  SceneParts parts = box_parts();
  const auto read = parts.read_frame;
  const std::string off = ask(box_orbit(), spot_at({0.4, 0.02, 0.01})).reading.frames[1].frame;
  parts.read_frame = [=](const ThermalFrame& frame) -> Result<cv::Mat> {
    ORBITFUSE_ASSIGN(cv::Mat image, read(frame));
    if (frame.view.name == off) image += 30;
    return image;
  };
  const Answer answer = ask(box_orbit(std::move(parts)), spot_at({0.4, 0.02, 0.01}));
  EXPECT_NEAR(answer.reading.temperature_k, end_k, 1e-3);
  EXPECT_NEAR(answer.reading.max_k, end_k + 30, 1e-3) << "all that was read is told";
}

TEST(Measure, ABoxHoldsTheSurfaceInIt) {
  const ThermalScene scene = box_orbit();
  Request request;
  request.kind = Kind::box;
  request.box.center = {0.4, 0, 0};
  request.box.size = {0.02, 0.2, 0.2};
  const Answer answer = ask(scene, request);
  EXPECT_NEAR(answer.reading.temperature_k, end_k, 0.05);
  EXPECT_NEAR(answer.reading.field_k, end_k, 0.05);
  EXPECT_GT(answer.reading.points, 100);
  EXPECT_LT(answer.reading.standard_deviation_k, 0.1);
  // Turned by 90 degrees about z it lies along the other axis: no surface there.
  request.box.rotation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  request.box.center = {0, 0, 0};
  const Answer inside = ask(scene, request);
  EXPECT_FALSE(inside.reading.seen());
  ASSERT_FALSE(inside.notes.empty());
  EXPECT_THAT(inside.notes[0], HasSubstr("no surface that one sees lies in it"));
}

TEST(Measure, APolygonHoldsWhatItsViewShows) {
  const ThermalScene scene = box_orbit();
  const PosedView& view = scene.frames()[0].view;
  Request request;
  request.kind = Kind::polygon;
  for (const auto& [y, z] : {std::pair(-0.1, -0.1), {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}})
    request.places.emplace_back(PixelPlace{
        view.name, view.camera.project(view.cam_from_world * Eigen::Vector3d(0.4, y, z))});
  const Answer answer = ask(scene, request);
  EXPECT_NEAR(answer.reading.temperature_k, end_k, 0.05);
  ASSERT_TRUE(answer.position);
  EXPECT_LT((*answer.position - Eigen::Vector3d(0.4, 0, 0)).norm(), 0.02);
}

TEST(Measure, ALineGivesItsProfile) {
  const ThermalScene scene = box_orbit();
  Request request;
  request.kind = Kind::line;
  request.profile = 41;
  request.places = {Eigen::Vector3d(0.4, -0.12, 0), Eigen::Vector3d(0.4, 0.12, 0)};
  const Answer answer = ask(scene, request);
  ASSERT_EQ(answer.profile.size(), 41u);
  EXPECT_NEAR(answer.profile.back().along, 0.24, 0.005);
  for (const ProfilePoint& point : answer.profile) {
    ASSERT_TRUE(point.at);
    EXPECT_NEAR(point.at->reading.field_k, end_k, 0.05);
  }
  // Ends that no frame sees together.
  request.places = {Eigen::Vector3d(0.4, 0, 0), Eigen::Vector3d(-0.4, 0, 0)};
  const auto round = measure(scene, request, {});
  ASSERT_FALSE(round);
  EXPECT_THAT(round.error().found, HasSubstr("no thermal frame sees both"));
}

TEST(Measure, HottestAreTheRibsAndColdestTheEnds) {
  const ThermalScene scene = box_orbit();
  Request request;
  request.kind = Kind::hottest;
  request.count = 4;
  request.apart = 0.1;
  const Answer hottest = ask(scene, request);
  ASSERT_EQ(hottest.spots.size(), 4u);
  for (const PlacedReading& spot : hottest.spots) {
    EXPECT_NEAR(spot.reading.temperature_k, rib_k, 0.3);
    EXPECT_GT(std::abs(spot.normal.y()), 0.9) << "ribs are on the sides of both boxes";
    for (const PlacedReading& other : hottest.spots)
      EXPECT_TRUE(&other == &spot || (other.position - spot.position).norm() >= 0.1);
  }
  request.kind = Kind::coldest;
  request.count = 1000;
  const Answer coldest = ask(scene, request);
  EXPECT_NEAR(coldest.spots.at(0).reading.temperature_k, end_k, 0.3);
  EXPECT_LT(coldest.spots.size(), 1000u);
  ASSERT_FALSE(coldest.notes.empty());
  EXPECT_THAT(coldest.notes[0], HasSubstr("of 1000 found"));
}

TEST(Measure, DifferenceAndDistanceOfTwo) {
  SceneParts parts = box_parts();
  Request request;
  request.kind = Kind::difference;
  request.of = {spot_at({0, 0, 0.15}), spot_at({0.4, 0.02, 0.01})};
  const ThermalScene scene = box_orbit();
  const Answer difference = ask(scene, request);
  EXPECT_NEAR(difference.difference_k, top_k - end_k, 0.05);
  EXPECT_GT(difference.difference_uncertainty_k, difference.of[0].reading.uncertainty_k);
  request.kind = Kind::distance;
  request.of.clear();
  request.places = {Eigen::Vector3d(0.4, 0, 0), Eigen::Vector3d(0.4, 0.1, 0)};
  const Answer unscaled = ask(scene, request);
  EXPECT_NEAR(unscaled.distance, 0.1, 1e-9);
  EXPECT_FALSE(unscaled.distance_m);
  EXPECT_THAT(unscaled.notes.at(0), HasSubstr("no scale"));
  parts.metres_per_unit = 2.5;
  const Answer scaled = ask(box_orbit(std::move(parts)), request);
  EXPECT_NEAR(scaled.distance_m.value_or(0), 0.25, 1e-9);
}

TEST(Measure, WhatIsKeptNamesPointsNotPixels) {
  const ThermalScene scene = box_orbit();
  const PosedView& view = scene.frames()[0].view;
  const auto pixel = [&](double y) {
    return PixelPlace{view.name,
                      view.camera.project(view.cam_from_world * Eigen::Vector3d(0.4, y, 0.01))};
  };
  Request spot, line;
  spot.places = {pixel(0.02)};
  line.kind = Kind::line;
  line.profile = 5;
  line.places = {pixel(-0.1), pixel(0.1)};
  Request both;
  both.kind = Kind::difference;
  both.of = {spot, line};
  const Request kept = anchored(both, ask(scene, both));
  for (const Request& part : kept.of)
    for (const Place& place : part.places) {
      ASSERT_TRUE(std::holds_alternative<Eigen::Vector3d>(place));
      EXPECT_NEAR(std::get<Eigen::Vector3d>(place).x(), 0.4, 1e-4);
    }
  EXPECT_TRUE(kept.validate());
}

TEST(Measure, SeveralThreadsGetTheSameAnswers) {
  const ThermalScene scene = box_orbit();
  const Request requests[] = {spot_at({0.4, 0.02, 0.01}), spot_at({0, 0, 0.15})};
  std::vector<std::string> answers(8);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < answers.size(); ++i)
    threads.emplace_back([&, i] {
      const auto answer = measure(scene, requests[i % 2], {});
      answers[i] = answer ? to_json(*answer).dump() : answer.error().message();
    });
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 2; i < answers.size(); ++i) EXPECT_EQ(answers[i], answers[i % 2]);
  EXPECT_NE(answers[0], answers[1]);
}

TEST(Measure, TablesHaveACellForEveryColumn) {
  const ThermalScene scene = box_orbit();
  Request line;
  line.kind = Kind::line;
  line.profile = 3;
  line.places = {Eigen::Vector3d(0.4, -0.1, 0), Eigen::Vector3d(0.4, 0.1, 0)};
  const std::string header = csv_header();
  const auto columns = std::count(header.begin(), header.end(), ',');
  for (const Request& request : {spot_at({0.4, 0, 0}), spot_at({0, 0, 0}), line}) {
    const Answer answer = ask(scene, request);
    const auto rows = csv_rows("plain", answer);
    ASSERT_FALSE(rows.empty());
    EXPECT_EQ(rows.size(), request.kind == Kind::line ? 4u : 1u);
    for (const std::string& row : rows) {
      EXPECT_THAT(row, Not(HasSubstr("nan")));
      bool inside = false;
      long count = 0;
      for (const char c : row) {
        if (c == '"') inside = !inside;
        count += c == ',' && !inside;
      }
      EXPECT_EQ(count, columns) << row;
    }
    EXPECT_FALSE(described(answer).empty());
  }
}

}  // namespace
}  // namespace orbitfuse::measurement
