// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/measure.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>
#include <thread>

#include "recon/measurement/region.hpp"
#include "recon/measurement/surface_samples.hpp"
#include "recon/measurement/table.hpp"
#include "tests/recon/measurement/box_orbit.hpp"

namespace orbitfuse::measurement {
namespace {
using namespace testing_box;
using testing::HasSubstr;

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

/// 25 degrees on 640 px; a phone's 4000. What a pixel's neighbourhood is must not hang on either.
TEST(Measure, APixelOfANarrowOrALargeViewIsTheSamePlace) {
  struct Validated {
    FieldRenderer field = box_field();
    Result<FieldView> operator()(const Camera& camera, const Rigid3d& pose,
                                 const Progress& progress) const {
      ORBITFUSE_TRY(camera.validate("window"));
      return field(camera, pose, progress);
    }
  };
  SceneParts parts = box_parts();
  parts.field = Validated{};
  const ThermalScene scene = box_orbit(std::move(parts));
  PosedView view = scene.frames().front().view;
  const Eigen::Vector3d on_end{0.4, 0.02, 0.01};
  for (const double scale : {1.0, 12.0}) {
    PosedView other = view;
    other.camera =
        view.camera.scaled_to(static_cast<int>(320 * scale), static_cast<int>(240 * scale));
    if (scale == 1) other.camera.fx = other.camera.fy = 5 * other.camera.width;
    const Eigen::Vector2d pixel = other.camera.project(other.cam_from_world * on_end);
    const auto there = scene.surface_at(other, pixel, {});
    ASSERT_TRUE(there) << there.error().message();
    EXPECT_LT((there->position - on_end).norm(), 0.01) << scale;
    EXPECT_GT(there->normal.x(), 0.99) << scale;
  }
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

TEST(Measure, ThePicturesSizeDoesNotChangeTheSurface) {
  const ThermalScene scene = box_orbit();
  PosedView view = scene.frames()[0].view;
  const Eigen::Vector3d near_edge(0.4, 0.145, 0.01);
  std::vector<SurfacePoint> found;
  for (const int width : {320, 640, 1920}) {
    view.camera = view.camera.scaled_to(width, width * 3 / 4);
    const auto surface =
        scene.surface_at(view, view.camera.project(view.cam_from_world * near_edge), {});
    ASSERT_TRUE(surface) << surface.error().message();
    found.push_back(*surface);
  }
  EXPECT_GT(found[0].variation_k, 0.01) << "the edge is within reach";
  for (const SurfacePoint& other : found) {
    EXPECT_NEAR(other.variation_k, found[0].variation_k, 1e-3);
    EXPECT_LT((other.normal - found[0].normal).norm(), 1e-3);
  }
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
  for (const FrameLine& line : answer.reading.frames) {
    EXPECT_EQ(line.used, line.frame != off);
    EXPECT_EQ(line.weight > 0, line.used);
  }
  EXPECT_EQ(answer.notes.size(), 1u);
  EXPECT_THAT(answer.notes.at(0), HasSubstr("left out: 56.9 C against 26.9 C"));
}

/// Half of the frames that see the end (every second, by name) read `off_k` more.
SceneParts contradicted_parts(double off_k) {
  SceneParts parts = box_parts();
  const Answer all = ask(box_orbit(), spot_at({0.4, 0.02, 0.01}));
  std::set<std::string> off;
  for (std::size_t i = 0; i < all.reading.frames.size(); i += 2)
    off.insert(all.reading.frames[i].frame);
  const auto read = parts.read_frame;
  parts.read_frame = [=](const ThermalFrame& frame) -> Result<cv::Mat> {
    ORBITFUSE_ASSIGN(cv::Mat image, read(frame));
    if (off.count(frame.view.name) > 0) image += off_k;
    return image;
  };
  return parts;
}

std::string joined(const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& note : notes) text += note + "\n";
  return text;
}

TEST(Measure, FramesThatContradictEachOtherAreAllUsedAndTold) {
  const ThermalScene scene = box_orbit(contradicted_parts(10));
  const Answer answer = ask(scene, spot_at({0.4, 0.02, 0.01}));
  EXPECT_LT(answer.reading.temperature_k - answer.reading.uncertainty_k, end_k);
  EXPECT_GT(answer.reading.temperature_k + answer.reading.uncertainty_k, end_k + 10);
  EXPECT_THAT(joined(answer.notes), HasSubstr("frames contradict the others"));
  for (const FrameLine& line : answer.reading.frames) EXPECT_TRUE(line.used);
  Request region;
  region.kind = Kind::box;
  region.box.center = {0.4, 0, 0};
  region.box.size = {0.02, 0.2, 0.2};
  const Answer box = ask(scene, region);
  EXPECT_LT(box.reading.temperature_k - box.reading.uncertainty_k, end_k);
  EXPECT_THAT(joined(box.notes), HasSubstr("frames contradict each other at"));
}

TEST(Measure, WhatNoFrameSeesOfARegionIsTold) {
  // Frames of one side only: they see one half of a box round both ends, the field has all of it.
  SceneParts parts = box_parts();
  std::erase_if(parts.frames, [](const ThermalFrame& frame) {
    return camera_center(frame.view.cam_from_world).x() < 0.5;
  });
  const ThermalScene scene = box_orbit(std::move(parts));
  std::vector<SurfacePoint> points;
  for (int i = 0; i < 30; ++i) {
    SurfacePoint point;
    const bool front = i < 10;
    point.position = {front ? 0.4 : -0.4, 0.01 * (i % 10) - 0.05, 0.01};
    point.normal = {front ? 1.0 : -1.0, 0, 0};
    point.field_k = front ? end_k : end_k + 20;
    points.push_back(point);
  }
  const auto reading = read_region(scene, points, {}, {});
  ASSERT_TRUE(reading) << reading.error().message();
  EXPECT_EQ(reading->points, 30);
  EXPECT_EQ(reading->seen_points, 10);
  EXPECT_NEAR(reading->seen_share, 1.0 / 3, 1e-9);
  EXPECT_THAT(reading->hidden, HasSubstr("too flat"));
  // Of frames, whatever the number of points.
  for (std::size_t at = 0;
       (at = reading->hidden.find_first_of("123456789", at)) != std::string::npos;
       at = reading->hidden.find(' ', at))
    EXPECT_LE(std::stoul(reading->hidden.substr(at)), scene.frames().size()) << reading->hidden;
  for (const FrameLine& line : reading->frames) EXPECT_LE(line.covered, 1.0 / 3 + 1e-9);
  EXPECT_LT(reading->uncertainty_k, 1) << "the unseen half's field doesn't say how sure this is";
  Answer answer;
  answer.reading = *reading;
  EXPECT_EQ(to_json(answer)["reading"]["seen_points"], 10);
}

TEST(Measure, APolygonOfAnUnseenSideSaysHowMuch) {
  SceneParts parts = box_parts();
  // A camera from above sees the top and both ends' edges; no frame at -x is left.
  for (const ThermalFrame& frame : parts.frames) {
    PosedView view = frame.view;
    view.name = "unposed " + view.name;
    parts.views.push_back(view);
  }
  std::erase_if(parts.frames, [](const ThermalFrame& frame) {
    return camera_center(frame.view.cam_from_world).x() < 0.5;
  });
  const PosedView* side = nullptr;
  for (const PosedView& view : parts.views)
    if (camera_center(view.cam_from_world).x() < -1.2 &&
        std::abs(camera_center(view.cam_from_world).y()) > 0.5)
      side = &view;
  ASSERT_NE(side, nullptr);
  Request request;
  request.kind = Kind::polygon;
  for (const auto& [u, v] : {std::pair(0, 0), {320, 0}, {320, 240}, {0, 240}})
    request.places.emplace_back(PixelPlace{side->name, Eigen::Vector2d(u, v)});
  const Answer answer = ask(box_orbit(std::move(parts)), request);
  ASSERT_TRUE(answer.reading.seen());
  EXPECT_LT(answer.reading.seen_share, 0.9);
  EXPECT_THAT(joined(answer.notes), HasSubstr("no thermal frame sees"));
}

/// The frames' pictures, changed round where they show the end's middle: what a frame adds there,
/// and how much that grows with each pixel.
SceneParts frames_with(const std::function<std::pair<double, double>(std::size_t)>& change) {
  const Eigen::Vector3d place(0.4, 0.02, 0.01);
  const Answer all = ask(box_orbit(), spot_at(place));
  std::map<std::string, std::pair<double, double>> changes;
  for (std::size_t i = 0; i < all.reading.frames.size(); ++i)
    changes[all.reading.frames[i].frame] = change(i);
  SceneParts parts = box_parts();
  parts.read_frame = [=, read = parts.read_frame](const ThermalFrame& frame) -> Result<cv::Mat> {
    ORBITFUSE_ASSIGN(cv::Mat image, read(frame));
    const auto found = changes.find(frame.view.name);
    if (found == changes.end()) return image;
    const auto [offset_k, k_per_px] = found->second;
    const Eigen::Vector2d p = frame.view.camera.project(frame.view.cam_from_world * place);
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x)
        if (std::abs(x + 0.5 - p.x()) < 6 && std::abs(y + 0.5 - p.y()) < 6)
          image.at<float>(y, x) += static_cast<float>(offset_k + k_per_px * (x + 0.5 - p.x()));
    return image;
  };
  return parts;
}

TEST(Measure, FramesFarApartAreToldInWordsToo) {
  // At an edge that all see; it keeps the first among the others.
  const ThermalScene scene =
      box_orbit(frames_with([](std::size_t i) { return std::pair(i == 0 ? 40.0 : 0.0, 20.0); }));
  const Answer answer = ask(scene, spot_at({0.4, 0.02, 0.01}));
  EXPECT_GT(answer.reading.uncertainty_k, 5);
  ASSERT_EQ(answer.notes.size(), 1u) << joined(answer.notes);
  EXPECT_THAT(answer.notes[0], HasSubstr("its frames are far apart (26."));
  EXPECT_THAT(answer.notes[0], HasSubstr("the place is small, at an edge or seen from the side"));
  EXPECT_THAT(csv_rows("x", answer).at(0), HasSubstr("its frames are far apart"));
}

TEST(Measure, WhyAFrameIsLeftOutDoesNotContradictOneThatIsUsed) {
  // As far off as the first and farther, but steep: an error of its pose explains it.
  const ThermalScene scene = box_orbit(frames_with([](std::size_t i) {
    return i == 0 ? std::pair(20.0, 0.0) : i == 1 ? std::pair(40.0, 40.0) : std::pair(0.0, 0.0);
  }));
  const Answer answer = ask(scene, spot_at({0.4, 0.02, 0.01}));
  EXPECT_FALSE(answer.reading.frames.at(0).used);
  EXPECT_TRUE(answer.reading.frames.at(1).used);
  EXPECT_THAT(joined(answer.notes), HasSubstr("left out: 46.9 C against 26.9 C in the middle of"));
  EXPECT_THAT(joined(answer.notes), HasSubstr("as far off and count see an edge there"));
}

TEST(Measure, NoEdgeIsToldWhereNoCountedFrameIsFarOff) {
  const ThermalScene scene = box_orbit(frames_with([](std::size_t i) {
    return std::pair(i == 0 ? -7.0 : i == 1 ? 8.0 : 0.0, 0.0);
  }));
  const Answer answer = ask(scene, spot_at({0.4, 0.02, 0.01}));
  EXPECT_THAT(joined(answer.notes), HasSubstr("26.9 C in the middle of the others"));
  EXPECT_THAT(joined(answer.notes), Not(HasSubstr("see an edge")));
}

TEST(Measure, ARowOfATableHasItsOwnNotesOnly) {
  Answer answer;
  answer.kind = Kind::hottest;
  answer.spots.resize(2);
  answer.spots[0].notes = {"of the first"};
  answer.notes = {"of all", place_words(0) + "of the first", place_words(1) + "of the camera"};
  const auto rows = csv_rows("warm", answer);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_THAT(rows[0], HasSubstr("of the first; of all"));
  EXPECT_THAT(rows[1], AllOf(HasSubstr("of all"), Not(HasSubstr("first"))));
  for (const std::string& row : rows) EXPECT_THAT(row, HasSubstr("of the camera"));  // no place's
  const auto read = answer_of_json(to_json(answer));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(csv_rows("warm", *read), rows);
}

TEST(Measure, ASmallHotSpotIsTheHottest) {
  // Three pixels wide in the frames, and 60 K above all else: steep, so less sure than the panel.
  const Eigen::Vector3d terminal(0.4, 0.02, 0.01);
  SceneParts parts = box_parts();
  const auto read = parts.read_frame;
  parts.read_frame = [=](const ThermalFrame& frame) -> Result<cv::Mat> {
    ORBITFUSE_ASSIGN(cv::Mat image, read(frame));
    const Eigen::Vector2d p = frame.view.camera.project(frame.view.cam_from_world * terminal);
    cv::circle(image, {static_cast<int>(p.x()), static_cast<int>(p.y())}, 1, end_k + 60, -1);
    return image;
  };
  const ThermalScene scene = box_orbit(std::move(parts));
  Request request;
  request.kind = Kind::hottest;
  request.count = 2;
  const Answer answer = ask(scene, request);
  ASSERT_EQ(answer.spots.size(), 2u);
  EXPECT_LT((answer.spots[0].position - terminal).norm(), 0.02);
  EXPECT_GT(answer.spots[0].reading.temperature_k, rib_k);
  EXPECT_GE(answer.spots[0].reading.temperature_k, answer.spots[1].reading.temperature_k);
}

TEST(Measure, PointsOfARegionWeighWhatTheirSurfaceDoes) {
  // As many cells of a grid meet an axis-parallel square as a smaller one turned by 45 degrees.
  const ThermalScene scene = box_orbit();
  OrientedBox box;
  box.size = {3, 3, 3};
  const auto points = box_samples(scene, box, {});
  ASSERT_TRUE(points);
  int straight = 0;
  for (const SurfacePoint& point : *points) {
    const double cells = point.normal.cwiseAbs().sum();
    EXPECT_NEAR(point.weight * cells, 1, 1e-9);
    straight += cells < 1.01;
  }
  EXPECT_GT(straight, 10);
}

TEST(Measure, DoubtIsToldWithItsWeight) {
  SceneParts parts = box_parts();
  const std::string doubted = ask(box_orbit(), spot_at({0.4, 0.02, 0.01})).reading.frames[0].frame;
  for (ThermalFrame& frame : parts.frames)
    if (frame.view.name == doubted) frame.doubt = "temperatures place it elsewhere";
  const ThermalScene scene = box_orbit(std::move(parts));
  const Answer spot = ask(scene, spot_at({0.4, 0.02, 0.01}));
  EXPECT_THAT(joined(spot.notes), HasSubstr("1 of "));
  EXPECT_THAT(joined(spot.notes), HasSubstr("doubtful poses"));
  Request coldest;
  coldest.kind = Kind::coldest;
  coldest.count = 8;
  const Answer cold = ask(scene, coldest);
  EXPECT_THAT(joined(cold.notes), HasSubstr("place "));
  EXPECT_THAT(joined(cold.notes), HasSubstr("doubtful poses"));
  EXPECT_THAT(described(spot).front(), HasSubstr("assumed for the camera"));
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

TEST(Measure, ABoxFarLargerThanWhatIsInItIsMeasuredAsFinely) {
  const ThermalScene scene = box_orbit();
  const auto within = [&](const Eigen::Vector3d& size) {
    Request request;
    request.kind = Kind::box;
    request.box.size = size;
    return ask(scene, request).reading;
  };
  const TemperatureReading close = within({2, 2, 2}), wide = within({1e6, 1e6, 1e6}),
                           beam = within({1e6, 0.2, 0.2});
  EXPECT_GE(wide.points, close.points / 2);
  EXPECT_NEAR(wide.temperature_k, close.temperature_k, 2);
  EXPECT_GT(beam.points, 20);
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

TEST(Measure, APolygonBeyondThePictureIsRefused) {
  const ThermalScene scene = box_orbit();
  Request request;
  request.kind = Kind::polygon;
  for (const auto& [u, v] : {std::pair(100, 60), {900, 60}, {900, 100}, {100, 100}})
    request.places.emplace_back(PixelPlace{scene.frames()[0].view.name, {u, v}});
  const auto answer = measure(scene, request, {});
  ASSERT_FALSE(answer);
  EXPECT_THAT(answer.error().message(), HasSubstr("outside of the picture"));
}

TEST(Measure, AViewRenderedOfAnEarlierWorldIsNamed) {
  SceneParts parts = box_parts();
  parts.outdated = {"007"};
  Request request;
  request.places = {PixelPlace{"007", {10, 10}}};
  const auto answer = measure(box_orbit(std::move(parts)), request, {});
  ASSERT_FALSE(answer);
  EXPECT_THAT(answer.error().message(), HasSubstr("before poses or fields were made anew"));
}

/// Its corners as places of the scene: as the frame shows them that sees all of them.
TEST(Measure, APolygonOfPointsIsWhatTheyEnclose) {
  const ThermalScene scene = box_orbit();
  Request request;
  request.kind = Kind::polygon;
  for (const auto& [y, z] : {std::pair(-0.1, -0.1), {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}})
    request.places.emplace_back(Eigen::Vector3d(0.4, y, z));
  const Answer answer = ask(scene, request);
  EXPECT_NEAR(answer.reading.temperature_k, end_k, 0.05);
  ASSERT_TRUE(answer.position);
  EXPECT_LT((*answer.position - Eigen::Vector3d(0.4, 0, 0)).norm(), 0.02);
  EXPECT_THAT(joined(answer.notes), HasSubstr("as seen from"));
  // On the box's other end: no frame sees both.
  request.places.emplace_back(Eigen::Vector3d(-0.4, 0, 0));
  const auto nowhere = measure(scene, request, {});
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error().message(), HasSubstr("no thermal frame sees all of its corners"));
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

TEST(Measure, ALinesProfileIsToldInShort) {
  Request line;
  line.kind = Kind::line;
  line.profile = 21;
  line.places = {Eigen::Vector3d(0.4, -0.1, 0), Eigen::Vector3d(0.4, 0.1, 0)};
  const std::string told = joined(described(ask(box_orbit(), line)));
  EXPECT_THAT(told, HasSubstr("profile in C: 26.9 "));
  EXPECT_THAT(told, HasSubstr("(9 of its 21 points; all with where they lie: --csv or --json)"));
  EXPECT_EQ(told.find(";\n"), std::string::npos);
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
    EXPECT_GT(std::abs(spot.normal.y()), 0.5) << "ribs are on the sides of both boxes";
    for (const PlacedReading& other : hottest.spots)
      EXPECT_TRUE(&other == &spot || (other.position - spot.position).norm() >= 0.1);
  }
  request.kind = Kind::coldest;
  request.count = 100;
  const Answer coldest = ask(scene, request);
  EXPECT_NEAR(coldest.spots.at(0).reading.temperature_k, end_k, 0.3);
  EXPECT_LT(coldest.spots.size(), 100u);
  ASSERT_FALSE(coldest.notes.empty());
  EXPECT_THAT(coldest.notes[0], HasSubstr("of 100 found"));
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
  EXPECT_TRUE(difference.notes.empty());
  EXPECT_EQ(to_json(difference).at("parameters_differ"), false);
  // One of them converted for another emissivity.
  Request unlike = request;
  unlike.of[1].object.emissivity = 0.6;
  for (Request& part : unlike.of) part.recorded.emissivity = 0.95;
  const Answer cautious = ask(scene, unlike);
  ASSERT_EQ(cautious.notes.size(), 1u);
  EXPECT_THAT(cautious.notes[0], HasSubstr("different object parameters"));
  EXPECT_THAT(cautious.notes[0], HasSubstr("emissivity 0.60 as asked"));
  EXPECT_EQ(to_json(cautious).at("parameters_differ"), true);
  request.kind = Kind::distance;
  request.of.clear();
  request.places = {Eigen::Vector3d(0.4, 0, 0), Eigen::Vector3d(0.4, 0.1, 0)};
  const Answer unscaled = ask(scene, request);
  EXPECT_NEAR(unscaled.distance, 0.1, 1e-9);
  EXPECT_FALSE(unscaled.distance_m);
  EXPECT_THAT(unscaled.notes.at(0), HasSubstr("no scale"));
  // Two points, each as far off as a reading is: .2 % of the orbit's radius.
  const double units = 1.645 * std::hypot(0.004, 0.004);
  EXPECT_NEAR(unscaled.distance_uncertainty, units, 1e-4);
  EXPECT_THAT(distance_words(unscaled), HasSubstr("0.1000 units of the run +- 0.009"));
  parts.metres_per_unit = 2.5;
  parts.scale_relative_sigma = 0.02;
  const Answer scaled = ask(box_orbit(std::move(parts)), request);
  EXPECT_NEAR(scaled.distance_m.value_or(0), 0.25, 1e-9);
  EXPECT_NEAR(scaled.distance_uncertainty_m, std::hypot(1.645 * 0.02 * 0.25, 2.5 * units), 2e-4);
  EXPECT_EQ(distance_words(scaled), "0.250 m +- 0.025");
  const auto again = answer_of_json(to_json(scaled));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->distance_uncertainty, scaled.distance_uncertainty);
  EXPECT_EQ(again->distance_uncertainty_m, scaled.distance_uncertainty_m);
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
  EXPECT_EQ(to_json(anchored(kept, ask(scene, kept))), to_json(kept)) << "again: it stays there";
}

TEST(Measure, WhatIsKeptOfASpotIsWhatItAnswersAgain) {
  const ThermalScene scene = box_orbit();
  const PosedView& view = scene.frames()[0].view;
  Request spot, difference;
  spot.places = {PixelPlace{
      view.name, view.camera.project(view.cam_from_world * Eigen::Vector3d(0.4, 0.02, 0.01))}};
  const auto kept = measure_anchored(scene, spot, {});
  ASSERT_TRUE(kept) << kept.error().message();
  difference.kind = Kind::difference;
  difference.of = {kept->request, spot};
  EXPECT_EQ(to_json(kept->answer), to_json(ask(scene, kept->request)));
  EXPECT_EQ(to_json(kept->answer), to_json(ask(scene, difference).of[0]));
  const auto both = measure_anchored(scene, difference, {});
  ASSERT_TRUE(both) << both.error().message();
  EXPECT_EQ(to_json(both->answer), to_json(ask(scene, both->request)));
  EXPECT_EQ(to_json(both->answer.of[1]), to_json(kept->answer));
  difference.of[0].kind = Kind::box;
  difference.of[0].places.clear();
  difference.of[0].box.center = {0.4, 0, 0};
  difference.of[0].box.size = {0.02, 0.2, 0.2};
  const auto mixed = measure_anchored(scene, difference, {});
  ASSERT_TRUE(mixed) << mixed.error().message();
  EXPECT_EQ(to_json(mixed->answer.of[1]), to_json(kept->answer));
  EXPECT_EQ(to_json(mixed->answer), to_json(ask(scene, mixed->request)));
}

TEST(Measure, ParametersThatNothingCanHaveAreBlamed) {
  const ThermalScene scene = box_orbit();
  Request spot;
  spot.places = {Eigen::Vector3d(0.4, 0.02, 0.01)};
  ASSERT_TRUE(ask(scene, spot).reading.seen());
  spot.recorded.emissivity = 0.95;
  spot.object.emissivity = 0.1;
  spot.object.reflected_temperature_k = 600;
  const Answer answer = ask(scene, spot);
  EXPECT_FALSE(answer.reading.seen());
  EXPECT_THAT(answer.reading.hidden, HasSubstr("no temperature by the object parameters"));
  EXPECT_THAT(answer.reading.hidden, testing::Not(HasSubstr("no temperature there")));
}

TEST(Measure, OnlyParametersThatAreKnownToDifferAreSaidToDiffer) {
  const UsedParameters recorded{0.95, 293.15, "emissivity 0.95 as recorded"},
      asked{0.95, 293.15, "emissivity 0.95 as asked"},
      other{0.6, 293.15, "emissivity 0.60 as asked"},
      camera{unknown, unknown, "emissivity not recorded"}, old{unknown, unknown, ""};
  EXPECT_FALSE(parameters_differ(recorded, recorded));
  EXPECT_FALSE(parameters_differ(recorded, asked)) << "the same numbers";
  EXPECT_FALSE(parameters_differ(camera, camera));
  EXPECT_FALSE(parameters_differ(recorded, old)) << "nothing is known to differ";
  EXPECT_TRUE(parameters_differ(recorded, other));
  EXPECT_TRUE(parameters_differ(camera, other));
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

TEST(Measure, ALineOfOnePlaceIsNone) {
  const ThermalScene scene = box_orbit();
  Request line;
  line.kind = Kind::line;
  line.places = {Eigen::Vector3d(0.4, 0.1, 0), Eigen::Vector3d(0.4, 0.1, 0)};
  const auto answer = measure(scene, line, {});
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().kind, ErrorKind::input);
  EXPECT_THAT(answer.error().message(), HasSubstr("one place"));
}

TEST(Measure, TablesHaveACellForEveryColumn) {
  const ThermalScene scene = box_orbit();
  Request line;
  line.kind = Kind::line;
  line.profile = 3;
  line.places = {Eigen::Vector3d(0.4, -0.1, 0), Eigen::Vector3d(0.4, 0.1, 0)};
  const std::string header = csv_header();
  const auto columns = std::count(header.begin(), header.end(), ',');
  Request distance = line;
  distance.kind = Kind::distance;
  EXPECT_THAT(header, HasSubstr(",distance,distance_uncertainty,distance_m,"));
  for (const Request& request : {spot_at({0.4, 0, 0}), spot_at({0, 0, 0}), line, distance}) {
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
