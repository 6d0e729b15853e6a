// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/whole_view.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/poses/cross_modal/view_recovery.hpp"
#include "recon/poses/world_frame.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"
#include "tests/support/thermal_ball.hpp"

namespace orbitfuse {
namespace {

PosedView orbit_view(double azimuth, double elevation, double radius = 2.5) {
  Camera camera = testing_orbit::camera(1000);
  camera = camera.scaled_to(320, 240);
  OrbitPose pose;
  pose.azimuth_deg = azimuth, pose.elevation_deg = elevation, pose.radius = radius;
  return {"view", camera, cam_from_world_of(pose, camera)};
}

cv::Mat thermal_of(const PosedView& view) {
  return testing_orbit::box_view(view.camera, view.cam_from_world, true).brightness;
}

OrbitAngles angles_of(const PosedView& view) {
  return orbit_angles(camera_center(view.cam_from_world));
}

TEST(WholeView, MovesAboutTheOrbitsCentre) {
  const Similarity3d canonical{0.5, Eigen::Quaterniond::Identity(), {1, 2, 3}};
  const Rigid3d there = orbit_view(30, 15).cam_from_world;
  const Rigid3d in_world = rebase(there, canonical.inverse());
  const Rigid3d found = rebase(moved(in_world, canonical, {20, -5, std::log(1.1)}), canonical);
  const OrbitAngles at = orbit_angles(camera_center(found));
  EXPECT_NEAR(at.azimuth_deg, 50, 1e-6);
  EXPECT_NEAR(at.elevation_deg, 10, 1e-6);
  EXPECT_NEAR(at.radius, 2.75, 1e-6);
  // What was in the middle of the image stays there.
  const Eigen::Vector3d before = there * Eigen::Vector3d::Zero(),
                        after = found * Eigen::Vector3d::Zero();
  EXPECT_LT((before.normalized() - after.normalized()).norm(), 1e-9);
}

TEST(WholeView, MatchFindsTheShiftAndAnEmptyImageNone) {
  const PosedView view = orbit_view(20, 15);
  const SceneRender seen = testing_orbit::box_view(view.camera, view.cam_from_world, false);
  const cv::Mat edges = rendered_edges(seen);
  cv::Mat shifted = cv::Mat::zeros(edges.size(), edges.type());
  edges(cv::Rect(0, 0, 310, 236)).copyTo(shifted(cv::Rect(7, 4, 310, 236)));
  const WholeMatch match = match_whole(edges, shifted, 10);
  EXPECT_EQ(match.shift_x_px, 7);
  EXPECT_EQ(match.shift_y_px, 4);
  EXPECT_GT(match.correlation, 0.9);
  EXPECT_EQ(match_whole(edges, cv::Mat::zeros(edges.size(), edges.type()), 10).correlation, -1);
}

TEST(WholeView, ClimbsBackOverTheRibs) {
  const PosedView truth = orbit_view(25, 14);
  PosedView view = orbit_view(30, 18, 2.6);
  const auto correlation =
      ascend_correlation(testing_orbit::box_renderer(), {}, thermal_of(truth), view, {}, {});
  ASSERT_TRUE(correlation) << correlation.error().message();
  EXPECT_NEAR(angles_of(view).azimuth_deg, 25, 1.5);
  EXPECT_NEAR(angles_of(view).elevation_deg, 14, 1.5);
}

TEST(RefineOrbit, ViewsOnTheNextRibComeHomeAndTrackingFramesFollow) {
  OrbitViews orbit;
  RenderAlignment alignment;
  std::vector<PosedView> truth;
  const auto add = [&](double azimuth, double wander) {
    truth.push_back(orbit_view(azimuth + wander, 14));
    orbit.images.push_back(thermal_of(truth.back()));
    Station station;
    station.azimuth_deg = azimuth - 40;  // an origin of its own
    orbit.stations.push_back(station);
  };
  for (int i = 0; i < 6; ++i) {
    add(60.0 * i, i % 2 == 0 ? 2 : -2);
    const double off = i == 2 ? 6 : 0.5;
    RenderAlignedView view;
    view.view = orbit_view(60.0 * i + (i % 2 == 0 ? 2 : -2) + off, i == 2 ? 18 : 14.5);
    alignment.views.push_back(view);
  }
  ASSERT_TRUE(refine_orbit(testing_orbit::box_renderer(), orbit, alignment, {1e-3}, {}));
  const auto off_deg = [&](std::size_t i) {
    return std::acos(camera_center(alignment.views[i].view.cam_from_world)
                         .normalized()
                         .dot(camera_center(truth[i].cam_from_world).normalized())) *
           57.3;
  };
  for (std::size_t i = 0; i < 6; ++i) EXPECT_LT(off_deg(i), 1.0) << "view " << i;

  for (const double azimuth : {20.0, 200.0}) {
    add(azimuth, 3);
    RenderAlignedView view;
    view.view = orbit_view(0, 0);
    alignment.views.push_back(view);
  }
  ASSERT_TRUE(add_views(testing_orbit::box_renderer(), orbit, 6, alignment, {}));
  for (std::size_t i = 6; i < 8; ++i) EXPECT_LT(off_deg(i), 1.0) << "tracking frame " << i;
}

TEST(RefineOrbit, ARendererThatFailsIsPassedOn) {
  OrbitViews orbit;
  orbit.images.push_back(thermal_of(orbit_view(0, 14)));
  orbit.stations.emplace_back();
  RenderAlignment alignment;
  RenderAlignedView view;
  view.view = orbit_view(0, 14);
  alignment.views.push_back(view);
  const SceneRenderer broken = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "cut", "train again");
  };
  const Status done = refine_orbit(broken, orbit, alignment, {0.03}, {});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().where, "field");
}

TEST(RefineOrbit, ConstantImagesChangeNothingAndStayFinite) {
  OrbitViews orbit;
  RenderAlignment alignment;
  for (int i = 0; i < 3; ++i) {
    RenderAlignedView view;
    view.view = orbit_view(60 * i, 14);
    alignment.views.push_back(view);
    orbit.images.push_back(cv::Mat(240, 320, CV_32F, cv::Scalar(300)));
    Station station;
    station.azimuth_deg = 60 * i;
    orbit.stations.push_back(station);
  }
  ASSERT_TRUE(refine_orbit(testing_orbit::box_renderer(), orbit, alignment, {0.03}, {}));
  for (const RenderAlignedView& view : alignment.views) {
    EXPECT_TRUE(view.view.cam_from_world.is_finite());
    EXPECT_EQ(view.support(), 0);
  }
}

TEST(RefineOrbit, WhatWasJudgedThroughAnotherLensIsJudgedAnew) {
  // Edges that two modalities share lie beside each other: the lens that they tell is another, and
  // seen through it every view contradicts the others. Patches of the thermal views tell the lens.
  testing_orbit::Ball ball;
  const SceneRenderer beside = [](const Camera& camera, const Rigid3d& pose) {
    SceneRender seen = testing_orbit::ball_view(camera, pose, false);
    Camera longer = camera;
    longer.fx *= 1.2, longer.fy *= 1.2;
    seen.brightness = testing_orbit::ball_view(longer, pose, false).brightness;
    return Result<SceneRender>(seen);
  };
  std::vector<std::string> told;
  ball.progress.report = [&](const ProgressEvent& event) { told.push_back(event.detail); };
  ASSERT_TRUE(refine_orbit(beside, ball.orbit, ball.alignment, {0.3, 0}, ball.progress));
  ASSERT_EQ(
      std::count(told.begin(), told.end(), "12 views contradicted by the others' temperatures"), 1)
      << "the case that this is about";
  EXPECT_NEAR(ball.focal_error(), 0, 0.03);
  for (const RenderAlignedView& view : ball.alignment.views)
    EXPECT_TRUE(view.verdict.sure()) << view.view.name << ": " << view.verdict.detail;
}

}  // namespace
}  // namespace orbitfuse
