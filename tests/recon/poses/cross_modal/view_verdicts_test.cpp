// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/view_verdicts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <limits>

#include "recon/poses/cross_modal/orbit_selection.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

const ViewEvidence good{0.9, 0.94, 2, 1, 0.03, 0.02};

TEST(ViewVerdicts, WhatSpeaksAgainstAViewIsNamed) {
  EXPECT_TRUE(judged(good, {}).sure());
  const auto reason = [](auto member, double value) {
    ViewEvidence seen = good;
    seen.*member = value;
    const ViewVerdict verdict = judged(seen, {});
    EXPECT_EQ(verdict.confidence == Confidence::sure, verdict.reason == DoubtReason::none);
    return verdict.reason;
  };
  // As measured on a loop at half its distance: support 7 of 43, correlation .42, aim 133 of 640
  // px.
  EXPECT_EQ(reason(&ViewEvidence::support_share, 7.0 / 43), DoubtReason::weak_support);
  EXPECT_EQ(reason(&ViewEvidence::correlation, 0.42), DoubtReason::temperatures_unlike);
  EXPECT_EQ(reason(&ViewEvidence::aim_off, 133.0 / 640), DoubtReason::off_its_loop);
  EXPECT_EQ(reason(&ViewEvidence::log_distance_off, std::log(2.22 / 1.34)),
            DoubtReason::off_its_loop);
  EXPECT_EQ(reason(&ViewEvidence::azimuth_off_deg, 15), DoubtReason::off_its_loop);
  EXPECT_EQ(reason(&ViewEvidence::elevation_off_deg, 12), DoubtReason::off_its_loop);
  ViewEvidence alone = good;
  alone.correlation.reset();  // nothing was painted
  EXPECT_EQ(judged(alone, {}).reason, DoubtReason::undecided);
  ViewEvidence weak = good;
  weak.median_correlation = 0.96;
  weak.support_share = 0.5, weak.correlation = 0.57;
  EXPECT_EQ(judged(weak, {}).reason, DoubtReason::weak_support);
  weak.support_share = 0.8;
  EXPECT_TRUE(judged(weak, {}).sure()) << "one of both is no reason";
  weak.support_share = 0.5, weak.correlation = 0.9;
  EXPECT_TRUE(judged(weak, {}).sure());
  // As measured on a view 9 % off; of scenes where the median view has few patches nobody is asked.
  ViewEvidence unconfirmed = good;
  unconfirmed.support_share = 0.56, unconfirmed.confirmed_share = 0.04;
  EXPECT_TRUE(judged(unconfirmed, {}).sure());
  unconfirmed.patches_tell = true;
  EXPECT_EQ(judged(unconfirmed, {}).reason, DoubtReason::weak_support);
  unconfirmed.confirmed_share = 0.24;
  EXPECT_TRUE(judged(unconfirmed, {}).sure());
  unconfirmed.support_share = 0.8, unconfirmed.confirmed_share = 0;
  EXPECT_TRUE(judged(unconfirmed, {}).sure()) << "form knows it well";
  // A painted scene's doubt is overruled by what neighbours measured, not by anything else.
  const ViewVerdict painted{Confidence::doubtful, DoubtReason::temperatures_elsewhere, "1 deg"};
  ViewEvidence confirmed = good;
  confirmed.confirmed_share = 0.39;
  EXPECT_FALSE(judged(confirmed, painted).sure());
  confirmed.confirmed_share = 0.5;
  EXPECT_TRUE(judged(confirmed, painted).sure());
  confirmed.support_share = 0.5;
  EXPECT_FALSE(judged(confirmed, painted).sure()) << "frames 3 degrees off had 0.74 of the patches";
  confirmed.confirmed_share = 0.9;
  EXPECT_TRUE(judged(confirmed, painted).sure());
  EXPECT_TRUE(judged(confirmed, {Confidence::doubtful, DoubtReason::not_found, ""}).sure());
  EXPECT_FALSE(judged(confirmed, {Confidence::doubtful, DoubtReason::undecided, ""}).sure());
  confirmed.support_share = 0.2;
  EXPECT_FALSE(judged(confirmed, painted).sure());
  confirmed.loop_support_share = 0.16;  // of a wrong loop, whose views confirm each other
  EXPECT_FALSE(judged(confirmed, {}).sure());
  confirmed.loop_support_share = 0.9;
  EXPECT_TRUE(judged(confirmed, {}).sure()) << "form knows its loop, and neighbours know it";
  // Patches that moved a view confirm it by themselves.
  EXPECT_FALSE(
      judged(confirmed, {Confidence::doubtful, DoubtReason::neighbours_elsewhere, ""}).sure());
  confirmed.support_share = 0.05;
  EXPECT_FALSE(judged(confirmed, {}).sure()) << "form knows nothing of it";
  ViewEvidence between = good;
  between.support_share = 0.67;
  EXPECT_TRUE(judged(between, {}).sure());
  EXPECT_EQ(judged_between(between, {}).reason, DoubtReason::weak_support);
  EXPECT_TRUE(judged_between(good, {}).sure());
  // Stations' patches place a frame between them, whatever it was dropped for before they did.
  const ViewVerdict lost{Confidence::dropped, DoubtReason::not_found, "nowhere"};
  EXPECT_EQ(judged_between(between, lost).confidence, Confidence::dropped);
  between.confirmed_share = 0.9;
  EXPECT_TRUE(judged_between(between, {}).sure());
  EXPECT_TRUE(judged_between(between, lost).sure());
  // Some patches keep a lost frame, in doubt; nor do all of them where form hardly knows it.
  between.confirmed_share = 0.74;
  EXPECT_EQ(judged_between(between, lost).confidence, Confidence::doubtful);
  between.support_share = 0.38, between.confirmed_share = 0.95;
  EXPECT_EQ(judged_between(between, lost).confidence, Confidence::doubtful);
  between.correlation = 0.3;
  EXPECT_EQ(judged_between(between, lost).reason, DoubtReason::temperatures_unlike);
  ViewEvidence loose = good;
  loose.azimuth_off_deg = 15;
  EXPECT_FALSE(judged(loose, {}).sure());
  loose.azimuth_scatter_deg = 7;
  EXPECT_TRUE(judged(loose, {}).sure()) << "all stations were kept to 7 degrees only";
  loose.azimuth_off_deg = 26, loose.azimuth_scatter_deg = 60;
  EXPECT_FALSE(judged(loose, {}).sure());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(reason(&ViewEvidence::support_share, nan), DoubtReason::none);
  EXPECT_NE(reason(&ViewEvidence::aim_off, nan), DoubtReason::none);
  EXPECT_NE(reason(&ViewEvidence::log_distance_off, nan), DoubtReason::none);
  const ViewVerdict dropped{Confidence::dropped, DoubtReason::not_found, "nowhere"};
  EXPECT_EQ(judged(good, dropped).confidence, Confidence::dropped);
}

TEST(ViewVerdicts, AViewOnProbationStaysOnlyWhereItsImageAndPatchesAreTheOthers) {
  const ViewVerdict probation{Confidence::doubtful, DoubtReason::not_found, "nowhere", true};
  ViewEvidence seen = good;
  seen.median_correlation = 0.96, seen.correlation = 0.93;
  EXPECT_EQ(judged(seen, probation).confidence, Confidence::dropped) << "no patch confirms it";
  seen.confirmed_share = 0.3;
  const ViewVerdict kept = judged(seen, probation);
  EXPECT_EQ(kept.confidence, Confidence::doubtful);
  EXPECT_FALSE(kept.on_probation);
  seen.confirmed_share = 0.5;
  EXPECT_TRUE(judged(seen, probation).sure()) << "patches say so";
  // A right view of `car`, which the visible scene hardly knew: kept, in doubt.
  seen.support_share = 0.11, seen.confirmed_share = 0.34;
  EXPECT_EQ(judged(seen, probation).confidence, Confidence::doubtful);
  for (const std::optional<double> unlike :
       {std::optional(0.88), std::optional<double>(),
        std::optional(std::numeric_limits<double>::quiet_NaN())}) {
    seen.correlation = unlike;
    EXPECT_EQ(judged(seen, probation).confidence, Confidence::dropped);
    EXPECT_EQ(judged(seen, probation).reason, DoubtReason::not_found);
  }
}

TEST(ViewVerdicts, ALoopThatIsMostlyInDoubtIsSoAsAWhole) {
  OrbitViews orbit;
  Fit alignment;
  for (int i = 0; i < 12; ++i) {
    Station station;
    station.loop = i / 6;
    orbit.stations.push_back(station);
    RenderAlignedView view;
    if (i < 4) view.verdict = {Confidence::doubtful, DoubtReason::weak_support, ""};
    alignment.views.push_back(view);
  }
  EXPECT_EQ(doubt_whole_loops(orbit, alignment.views.size(), alignment), std::vector<int>{0});
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(alignment.views[i].verdict.sure(), i >= 6) << i;
  EXPECT_EQ(alignment.views[5].verdict.reason, DoubtReason::loop_in_doubt);
}

PosedView at(double azimuth, double elevation, double radius) {
  const Camera camera = testing_orbit::camera(1000).scaled_to(320, 240);
  OrbitPose pose;
  pose.azimuth_deg = azimuth, pose.elevation_deg = elevation, pose.radius = radius;
  return {"view", camera, cam_from_world_of(pose, camera)};
}

/// What is known of twelve views in two loops, six at these azimuths each, taken for an even walk.
std::vector<ViewEvidence> evidence_of_walk(const std::vector<double>& azimuths_deg, bool assumed) {
  const SceneRenderer renderer = testing_orbit::box_renderer();
  OrbitViews orbit;
  orbit.assumed = assumed;
  Fit alignment;
  for (int i = 0; i < 12; ++i) {
    RenderAlignedView view;
    view.view = at(azimuths_deg[static_cast<std::size_t>(i % 6)] + i / 6 * 9, i < 6 ? 10 : 32, 2.5);
    view.matches = 100;
    orbit.images.push_back(
        testing_orbit::box_view(view.view.camera, view.view.cam_from_world, true).brightness);
    Station station;
    // Nobody said where the first loop ends: its last view is counted to the second.
    station.loop = i < 5 ? 0 : 1;
    station.azimuth_deg = 60.0 * i + (i < 6 ? 0 : 9);
    orbit.stations.push_back(station);
    alignment.views.push_back(view);
  }
  const Progress progress;
  const auto evidence = evidence_of({renderer, orbit, progress}, 12, alignment);
  EXPECT_TRUE(evidence) << evidence.error().message();
  return evidence.value_or(std::vector<ViewEvidence>(12));
}

TEST(ViewVerdicts, AnUnevenWalkIsNoReasonToDoubtItsViewsWhereStationsWereAssumed) {
  const auto most_off = [](const std::vector<ViewEvidence>& all, double ViewEvidence::*member) {
    double most = 0;
    for (const ViewEvidence& seen : all) most = std::max(most, seen.*member);
    return most;
  };
  const std::vector<double> uneven = {0, 25, 100, 140, 230, 300};
  const auto told = evidence_of_walk(uneven, false), assumed = evidence_of_walk(uneven, true);
  EXPECT_GT(most_off(told, &ViewEvidence::azimuth_off_deg), 12);
  EXPECT_GT(most_off(told, &ViewEvidence::elevation_off_deg), 8);
  EXPECT_LT(most_off(assumed, &ViewEvidence::azimuth_off_deg), 1);
  EXPECT_LT(most_off(assumed, &ViewEvidence::elevation_off_deg), 1);
  // Against the order of capture: the third view behind the second.
  const auto crossed = evidence_of_walk({0, 100, 25, 140, 230, 300}, true);
  for (const std::size_t i : {1u, 2u, 7u, 8u})
    EXPECT_NEAR(crossed[i].azimuth_off_deg, 75, 0.1) << i;
  for (const std::size_t i : {0u, 3u, 4u, 5u}) EXPECT_LT(crossed[i].azimuth_off_deg, 1) << i;
}

/// A hypothesis that has the lower loop at the given distance.
OrbitHypothesis hypothesis(double lower_radius, double lower_elevation) {
  OrbitHypothesis h;
  for (int i = 0; i < 12; ++i) {
    OrbitPose pose;
    pose.azimuth_deg = 60.0 * (i % 6) + 2;
    pose.elevation_deg = i < 6 ? lower_elevation : 32;
    pose.radius = i < 6 ? lower_radius : 2.5;
    Station station;
    station.loop = i / 6, station.azimuth_deg = 60.0 * (i % 6);
    h.stations.push_back(station);
    h.poses.push_back(pose);
    h.nominal.push_back(pose);
    h.starts.push_back({pose});
  }
  return h;
}

TEST(SelectByRenders, ANearImpostorThatLinesPreferIsNotTaken) {
  OrbitViews orbit;
  std::vector<PosedView> blank, truth;
  for (int i = 0; i < 12; ++i) {
    truth.push_back(at(60.0 * (i % 6) + (i % 2 == 0 ? 3 : -3), i < 6 ? 10 : 32, 2.5));
    orbit.images.push_back(
        testing_orbit::box_view(truth.back().camera, truth.back().cam_from_world, true).brightness);
    blank.push_back({"view" + std::to_string(i), truth.back().camera, {}});
  }
  // The search's order: the impostor first, its lower loop at 0.6 of the distance.
  const auto selected = select_by_renders(testing_orbit::box_renderer(), orbit, blank,
                                          {hypothesis(1.5, 4), hypothesis(2.4, 12)}, {});
  ASSERT_TRUE(selected) << selected.error().message();
  EXPECT_EQ(selected->hypothesis, 1u);
  ASSERT_EQ(selected->alignment.views.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    const Rigid3d& found = selected->alignment.views[i].view.cam_from_world;
    EXPECT_LT((camera_center(found) - camera_center(truth[i].cam_from_world)).norm(), 0.15) << i;
    EXPECT_EQ(selected->alignment.views[i].view.name, blank[i].name);
  }
}

/// Looks the same from the other side, exactly.
Result<SceneRender> two_fold(const Camera& camera, const Rigid3d& cam_from_world, bool hot) {
  const Rigid3d half_turn{
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d::Zero()};
  const bool behind = camera_center(cam_from_world).y() < 0;
  return testing_orbit::box_view(camera, behind ? cam_from_world * half_turn : cam_from_world, hot);
}

TEST(SelectByRenders, TwoStartsThatExplainTheViewsAlikeAreToldApartByNothing) {
  OrbitViews orbit;
  std::vector<PosedView> blank;
  for (int i = 0; i < 12; ++i) {
    const PosedView truth = at(60.0 * (i % 6) + (i % 2 == 0 ? 3 : -3), i < 6 ? 10 : 32, 2.5);
    orbit.images.push_back(two_fold(truth.camera, truth.cam_from_world, true)->brightness);
    blank.push_back({"view" + std::to_string(i), truth.camera, {}});
  }
  const OrbitHypothesis right = hypothesis(2.4, 12);
  OrbitHypothesis turned = right;
  turned.offset_deg += 180;
  for (std::vector<OrbitPose>* poses : {&turned.poses, &turned.nominal})
    for (OrbitPose& pose : *poses) pose.azimuth_deg += 180;
  for (auto& starts : turned.starts)
    for (OrbitPose& pose : starts) pose.azimuth_deg += 180;
  const SceneRenderer renderer = [](const Camera& camera, const Rigid3d& pose) {
    return two_fold(camera, pose, false);
  };
  const auto alike = select_by_renders(renderer, orbit, blank, {right, turned}, {});
  ASSERT_TRUE(alike) << alike.error().message();
  ASSERT_TRUE(alike->lead_standard_errors);
  EXPECT_LT(std::abs(*alike->lead_standard_errors), 1);

  // The same two starts of a scene with a front: the lead is clear, or the rival isn't one.
  for (int i = 0; i < 12; ++i) {
    const PosedView truth = at(60.0 * (i % 6) + (i % 2 == 0 ? 3 : -3), i < 6 ? 10 : 32, 2.5);
    orbit.images[static_cast<std::size_t>(i)] =
        testing_orbit::box_view(truth.camera, truth.cam_from_world, true).brightness;
  }
  const auto told =
      select_by_renders(testing_orbit::box_renderer(), orbit, blank, {turned, right}, {});
  ASSERT_TRUE(told);
  EXPECT_EQ(told->hypothesis, 1u);
  EXPECT_GT(told->lead_standard_errors.value_or(9), 2);
}

TEST(SelectByRenders, ImagesInWhichNothingIsInPlaceAreAQualityError) {
  OrbitViews orbit;
  std::vector<PosedView> blank;
  for (int i = 0; i < 12; ++i) {
    const PosedView truth = at(60.0 * (i % 6), i < 6 ? 10 : 32, 2.5);
    orbit.images.emplace_back(truth.camera.height, truth.camera.width, CV_32F, cv::Scalar(290));
    blank.push_back({"view" + std::to_string(i), truth.camera, {}});
  }
  const auto selected = select_by_renders(testing_orbit::box_renderer(), orbit, blank,
                                          {hypothesis(2.4, 12), hypothesis(1.5, 4)}, {});
  ASSERT_FALSE(selected);
  EXPECT_EQ(selected.error().kind, ErrorKind::quality);
}

}  // namespace
}  // namespace orbitfuse
