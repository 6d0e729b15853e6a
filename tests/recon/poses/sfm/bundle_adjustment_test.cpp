// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/bundle_adjustment.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::seen_cube;
using testing_orbit::two_loops;

void disturb(Reconstruction& model, double angle_deg, double shift, unsigned seed = 3) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (std::size_t v = 1; v < model.views.size(); ++v) {
    Rigid3d& pose = model.views[v].cam_from_world;
    const Eigen::Vector3d axis =
        Eigen::Vector3d(normal(rng), normal(rng), normal(rng)).normalized();
    pose.rotation = Eigen::AngleAxisd(angle_deg * 0.0174533, axis) * pose.rotation;
    pose.translation += shift * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
  }
  for (SparsePoint& point : model.points)
    point.position += shift * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
}

double worst_rotation_deg(const Reconstruction& model, const std::vector<PosedView>& truth) {
  // Relative to the first view: the gauge is free.
  double worst = 0;
  const Eigen::Quaterniond first =
      model.views[0].cam_from_world.rotation.conjugate() * truth[0].cam_from_world.rotation;
  for (const PosedView& view : model.views)
    for (const PosedView& t : truth)
      if (t.name == view.name)
        worst = std::max(worst, rotation_angle_deg(view.cam_from_world.rotation * first,
                                                   t.cam_from_world.rotation));
  return worst;
}

const LensGroup held{600, 0, false, false};

TEST(BundleAdjustment, FindsPosesThroughNoise) {
  const auto truth = two_loops();
  Reconstruction model = seen_cube(truth, 200, 0.5);
  disturb(model, 1.0, 0.03);
  const auto report = adjust_bundle(model, std::vector<int>(24, 0), {held}, {});
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_LT(report->rms_px, 0.8);
  EXPECT_TRUE(report->dropped_views.empty());
  // 0.5 px of 600 is 0.05 deg in one ray; both ends of a relative rotation carry an error.
  EXPECT_LT(worst_rotation_deg(model, truth), 0.15);
}

TEST(BundleAdjustment, RejectsOutliers) {
  const auto truth = two_loops();
  Reconstruction model = seen_cube(truth, 300, 0.3);
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> anywhere(0, 480);
  int outliers = 0;
  for (SparsePoint& point : model.points)
    for (Observation& o : point.track)
      if (rng() % 10 == 0) o.pixel = {anywhere(rng), anywhere(rng)}, ++outliers;
  disturb(model, 0.5, 0.01);
  const auto report = adjust_bundle(model, std::vector<int>(24, 0), {held}, {});
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GT(report->outliers, outliers * 8 / 10);
  EXPECT_LT(worst_rotation_deg(model, truth), 0.15);
}

TEST(BundleAdjustment, WrongFocalIsFoundWhereTheOrbitTellsIt) {
  const auto truth = two_loops();
  Reconstruction model = seen_cube(truth, 300, 0.3);
  for (PosedView& view : model.views) view.camera.fx = view.camera.fy = 600 * 1.1;
  const auto report = adjust_bundle(model, std::vector<int>(24, 0), {{660, 0.3, false, false}}, {});
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NEAR(model.views[0].camera.fx, 600, 6);
}

TEST(BundleAdjustment, PureRotationIsAQualityErrorAndLeavesTheModel) {
  std::vector<PosedView> views = two_loops();
  for (PosedView& view : views)
    view.cam_from_world = {
        Eigen::Quaterniond(Eigen::AngleAxisd(0.01 * static_cast<double>(&view - views.data()),
                                             Eigen::Vector3d::UnitY())),
        {0, 0, 4}};
  for (PosedView& view : views)  // one centre
    view.cam_from_world.translation = view.cam_from_world.rotation * Eigen::Vector3d(0, 0, 4);
  Reconstruction model = seen_cube(views, 200, 0.3);
  const Eigen::Vector3d before = model.points.front().position;
  const auto report = adjust_bundle(model, std::vector<int>(24, 0), {held}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::quality);
  EXPECT_EQ(model.points.front().position, before);
}

TEST(BundleAdjustment, WeakViewIsDroppedAndNamed) {
  Reconstruction model = seen_cube(two_loops(), 200, 0.3);
  for (std::size_t i = 5; i < model.points.size(); ++i)
    std::erase_if(model.points[i].track, [](const Observation& o) { return o.view == 7; });
  const auto report = adjust_bundle(model, std::vector<int>(24, 0), {held}, {});
  ASSERT_TRUE(report) << report.error().message();
  ASSERT_EQ(report->dropped_views.size(), 1u);
  EXPECT_EQ(report->dropped_views[0], "view7");
  EXPECT_EQ(model.views.size(), 23u);
}

TEST(BundleAdjustment, PointsOnAPlaneKeepTheirPoses) {
  const auto truth = two_loops();
  Reconstruction model = seen_cube(truth, 300, 0.3, 1, true);
  disturb(model, 0.5, 0.01);
  const auto report = adjust_bundle(model, std::vector<int>(24, 0), {held}, {});
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_LT(worst_rotation_deg(model, truth), 0.2);
}

TEST(BundleAdjustment, SizesThatDisagreeAreAnInputError) {
  Reconstruction model = seen_cube(two_loops(), 50, 0.3);
  const auto report = adjust_bundle(model, {0, 0}, {held}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::input);
}

TEST(BundleAdjustment, PhotosOfSeveralSizesAreJudgedByTheirOwnPixels) {
  // Every second photo at three times the size, its noise and misses as well: by the first one's
  // pixels all of its observations would be outliers.
  const auto truth = two_loops();
  std::vector<PosedView> views = truth;
  for (std::size_t v = 0; v < views.size(); v += 2)
    views[v].camera = views[v].camera.scaled_to(1920, 1440);
  Reconstruction model = seen_cube(truth, 200, 0.5);
  model.views = views;
  for (SparsePoint& point : model.points)
    for (Observation& o : point.track)
      if (o.view % 2 == 0) o.pixel *= 3;
  disturb(model, 0.5, 0.01);
  BundleOptions options;
  options.loss_scale_px = 0.5, options.max_error_px = 1.4;
  std::vector<int> group;
  for (std::size_t v = 0; v < views.size(); ++v) group.push_back(v % 2 == 0 ? 1 : 0);
  const std::vector<LensGroup> lenses = {held, {1800, 0, false, false}};
  Reconstruction alike = model;
  const auto by_one_size = adjust_bundle(alike, group, lenses, options);
  for (std::size_t v = 0; v < views.size(); ++v) options.unit_px.push_back(v % 2 == 0 ? 3 : 1);
  const auto report = adjust_bundle(model, group, lenses, options);
  ASSERT_TRUE(report && by_one_size);
  EXPECT_LT(report->outliers, by_one_size->outliers / 4);
  EXPECT_LT(report->rms_px, 0.8);
  EXPECT_LT(worst_rotation_deg(model, truth), 0.15);
  for (const double nonsense : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    options.unit_px[3] = nonsense;
    EXPECT_EQ(adjust_bundle(model, group, lenses, options).error().kind, ErrorKind::input);
  }
  options.unit_px.pop_back();
  EXPECT_EQ(adjust_bundle(model, group, lenses, options).error().kind, ErrorKind::input);
}

TEST(BundleAdjustment, NotANumberIsAnError) {
  Reconstruction model = seen_cube(two_loops(), 50, 0.3);
  model.points[0].position.x() = std::nan("");
  model.views[3].cam_from_world.translation.y() = std::nan("");
  EXPECT_FALSE(adjust_bundle(model, std::vector<int>(24, 0), {held}, {}));
}

}  // namespace
}  // namespace orbitfuse
