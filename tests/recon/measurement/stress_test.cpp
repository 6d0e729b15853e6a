// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "recon/measurement/measure.hpp"
#include "recon/measurement/region.hpp"
#include "recon/measurement/surface_samples.hpp"
#include "tests/recon/measurement/box_orbit.hpp"

namespace orbitfuse::measurement {
namespace {
using namespace testing_box;
using testing::HasSubstr;

constexpr float nanf32 = std::numeric_limits<float>::quiet_NaN();

TEST(MeasurementStress, ScenesThatAreNoneAreRefused) {
  EXPECT_FALSE(ThermalScene::make({}, {}));
  SceneParts none = box_parts();
  none.frames.clear();
  EXPECT_FALSE(ThermalScene::make(std::move(none), {}));
  SceneParts broken = box_parts();
  broken.frames[3].view.cam_from_world.translation.x() = std::nan("");
  const auto refused = ThermalScene::make(std::move(broken), {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().where, HasSubstr("view3"));
  SceneParts scaled = box_parts();
  scaled.metres_per_unit = 0;
  EXPECT_FALSE(ThermalScene::make(std::move(scaled), {}));
  MeasurementOptions options;
  options.coverage_factor = std::nan("");
  EXPECT_FALSE(ThermalScene::make(box_parts(), options));
}

TEST(MeasurementStress, NothingIsSeenThroughNaN) {
  SceneParts parts = box_parts();
  parts.read_frame = [](const ThermalFrame& frame) -> Result<cv::Mat> {
    return cv::Mat(frame.view.camera.height, frame.view.camera.width, CV_32FC1,
                   cv::Scalar(std::nan("")));
  };
  const ThermalScene dead = box_orbit(std::move(parts));
  const auto spot = measure(dead, spot_at({0.4, 0, 0}), {});
  ASSERT_TRUE(spot) << spot.error().message();
  EXPECT_FALSE(spot->reading.seen());
  EXPECT_THAT(spot->reading.hidden, HasSubstr("no temperature there"));
  Request hottest;
  hottest.kind = Kind::hottest;
  const auto found = measure(dead, hottest, {});
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->spots.empty());
  EXPECT_FALSE(found->notes.empty());
}

TEST(MeasurementStress, AFieldOfHolesHasNoSurface) {
  SceneParts parts = box_parts();
  parts.field = [](const Camera& camera, const Rigid3d&, const Progress&) -> Result<FieldView> {
    const cv::Mat none(camera.height, camera.width, CV_32FC1, cv::Scalar(nanf32));
    return FieldView{none, none};
  };
  const std::string view = parts.frames[0].view.name;
  const ThermalScene scene = box_orbit(std::move(parts));
  Request pixel;
  pixel.places = {PixelPlace{view, {160, 120}}};
  const auto refused = measure(scene, pixel, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().found, HasSubstr("no surface"));
  const auto point = measure(scene, spot_at({0.4, 0, 0}), {});
  ASSERT_TRUE(point);
  EXPECT_FALSE(point->reading.seen());
}

TEST(MeasurementStress, PlacesThatAreNoneAreNamed) {
  const ThermalScene scene = box_orbit();
  for (const Eigen::Vector2d& outside :
       {Eigen::Vector2d(1e6, 10), Eigen::Vector2d(10, 241), Eigen::Vector2d(321, 0)}) {
    Request request;
    request.places = {PixelPlace{"view0", outside}};
    const auto refused = measure(scene, request, {});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message(), HasSubstr("outside of the picture"));
  }
  Request unknown;
  unknown.places = {PixelPlace{"view99", {1, 1}}};
  const auto refused = measure(scene, unknown, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("view9"));
  for (const double far : {std::nan(""), 1e300, -std::numeric_limits<double>::infinity()})
    EXPECT_FALSE(measure(scene, spot_at({far, 0, 0}), {}));
  // Sky.
  Request sky;
  sky.places = {PixelPlace{"view0", {0.5, 0.5}}};
  EXPECT_THAT(measure(scene, sky, {}).error().message(), HasSubstr("no surface"));
}

TEST(MeasurementStress, DegenerateRegionsHaveAnAnswer) {
  const ThermalScene scene = box_orbit();
  Request polygon;
  polygon.kind = Kind::polygon;
  for (int i = 0; i < 3; ++i) polygon.places.emplace_back(PixelPlace{"view0", {100, 100}});
  EXPECT_THAT(measure(scene, polygon, {}).error().message(), HasSubstr("no area"));
  polygon.places.clear();
  for (const auto& [x, y] : {std::pair(40., 40.), {60., 60.}, {60., 40.}, {40., 60.}})
    polygon.places.emplace_back(PixelPlace{"view0", {x, y}});
  EXPECT_THAT(measure(scene, polygon, {}).error().message(), HasSubstr("sides cross"));
  Request box;
  box.kind = Kind::box;
  box.box.size = {1e-12, 1e-12, 1e-12};
  const auto tiny = measure(scene, box, {});
  ASSERT_TRUE(tiny) << tiny.error().message();
  EXPECT_FALSE(tiny->reading.seen());
  box.box.size = {1e9, 1e9, 1e9};
  const auto all = measure(scene, box, {});
  ASSERT_TRUE(all);
  EXPECT_GE(all->reading.points, 1);
  Request line;
  line.kind = Kind::line;
  line.places = {PixelPlace{"view0", {0, 0}}, PixelPlace{"view0", {5, 0}}};
  const auto through_sky = measure(scene, line, {});
  ASSERT_TRUE(through_sky) << through_sky.error().message();
  EXPECT_FALSE(through_sky->reading.seen());
  EXPECT_GE(through_sky->notes.size(), 2u);
  const auto nothing = read_region(scene, {}, {}, {});
  ASSERT_TRUE(nothing);
  EXPECT_FALSE(nothing->seen());
  EXPECT_EQ(nothing->points, 0);
}

TEST(MeasurementStress, CamerasInALineHaveNoObject) {
  SceneParts parts = box_parts();
  parts.orbit = {parts.orbit[0], parts.orbit[0]};
  const ThermalScene scene = box_orbit(std::move(parts));
  Request hottest;
  hottest.kind = Kind::hottest;
  EXPECT_FALSE(measure(scene, hottest, {}));
}

TEST(MeasurementStress, OneFrameIsEnough) {
  SceneParts parts = box_parts();
  parts.frames.resize(1);
  const ThermalScene scene = box_orbit(std::move(parts));
  Request hottest;
  hottest.kind = Kind::hottest;
  hottest.count = 1;
  const auto found = measure(scene, hottest, {});
  ASSERT_TRUE(found) << found.error().message();
  ASSERT_EQ(found->spots.size(), 1u);
  EXPECT_TRUE(std::isnan(found->spots[0].reading.spread_k));
  EXPECT_TRUE(std::isfinite(found->spots[0].reading.uncertainty_k));
}

TEST(MeasurementStress, FramesThatCannotBeReadAreNamed) {
  SceneParts parts = box_parts();
  parts.read_frame = [](const ThermalFrame& frame) -> Result<cv::Mat> {
    return fail(ErrorKind::input, frame.view.name, "gone", "restore it");
  };
  const auto lost = measure(box_orbit(std::move(parts)), spot_at({0.4, 0, 0}), {});
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().found, "gone");
  parts = box_parts();
  parts.read_frame = [](const ThermalFrame&) -> Result<cv::Mat> { return cv::Mat1f(3, 4, 300.F); };
  const auto other = measure(box_orbit(std::move(parts)), spot_at({0.4, 0, 0}), {});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().found, HasSubstr("4x3"));
}

TEST(MeasurementStress, ACancelledOneLeavesNothingHalfMade) {
  const ThermalScene scene = box_orbit();
  std::atomic<bool> stop{true};
  Progress progress;
  progress.cancel = &stop;
  Request hottest;
  hottest.kind = Kind::hottest;
  const auto stopped = measure(scene, hottest, progress);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
  stop = false;
  EXPECT_TRUE(measure(scene, hottest, progress));
}

TEST(MeasurementStress, ReadingManyPointsStopsWhenAsked) {
  const ThermalScene scene = box_orbit();
  ASSERT_TRUE(measure(scene, spot_at({0.4, 0, 0}), {}))
      << "all frames' images and depths are there";
  SurfacePoint point;
  point.position = {0.4, 0, 0};
  point.normal = {1, 0, 0};
  std::atomic<bool> stop{true};
  Progress progress;
  progress.cancel = &stop;
  const auto stopped = read_region(scene, std::vector<SurfacePoint>(10000, point), {}, progress);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
  stop = false;
  const auto read = read_region(scene, std::vector<SurfacePoint>(10000, point), {}, progress);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->seen_points, 10000) << "in several lots";
}

}  // namespace
}  // namespace orbitfuse::measurement
