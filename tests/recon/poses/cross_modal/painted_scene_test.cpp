// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/painted_scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include <cmath>
#include <limits>

#include "recon/poses/cross_modal/cross_modal.hpp"
#include "recon/poses/cross_modal/temperature_consistency.hpp"
#include "recon/poses/cross_modal/view_recovery.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

PosedView at(double azimuth, double elevation = 14) {
  const Camera camera = testing_orbit::camera(1000).scaled_to(320, 240);
  OrbitPose pose;
  pose.azimuth_deg = azimuth, pose.elevation_deg = elevation, pose.radius = 2.5;
  return {"view", camera, cam_from_world_of(pose, camera)};
}

cv::Mat thermal_of(const PosedView& view, float offset = 0) {
  cv::Mat image = testing_orbit::box_view(view.camera, view.cam_from_world, true).brightness;
  image += cv::Scalar(offset);
  return image;
}

TEST(PaintedScene, ShowsTheTemperaturesSeenFromBesideIt) {
  const std::vector<PosedView> views = {at(15), at(45), at(200)};
  // The second camera drifted by half the scene's contrast.
  const std::vector<cv::Mat> images = {thermal_of(views[0]), thermal_of(views[1], 0.4F),
                                       thermal_of(views[2])};
  const SceneRenderer form = testing_orbit::box_renderer();
  const auto painted = painted_scene(form, views, images, {}, {});
  ASSERT_TRUE(painted) << painted.error().message();
  const PosedView between = at(27, 17);
  const auto seen = (*painted)(between.camera, between.cam_from_world);
  ASSERT_TRUE(seen);
  const cv::Mat truth = thermal_of(between);
  int on_box = 0, close = 0;
  for (int y = 0; y < truth.rows; ++y)
    for (int x = 0; x < truth.cols; ++x) {
      const float value = seen->brightness.at<float>(y, x);
      if (!std::isfinite(seen->depth.at<float>(y, x))) {
        EXPECT_TRUE(std::isnan(value));
        continue;
      }
      ++on_box;
      close += std::abs(value - truth.at<float>(y, x)) < 0.1F ? 1 : 0;
    }
  EXPECT_GT(on_box, 1000);
  EXPECT_GT(close, 9 * on_box / 10);
}

TEST(PaintedScene, WithoutPaintersNothingIsPainted) {
  const SceneRenderer form = testing_orbit::box_renderer();
  const auto painted = painted_scene(form, {}, {}, {}, {});
  ASSERT_TRUE(painted);
  const auto seen = (*painted)(at(0).camera, at(0).cam_from_world);
  ASSERT_TRUE(seen);
  for (const float value : cv::Mat1f(seen->brightness)) EXPECT_TRUE(std::isnan(value));
}

TEST(PaintedScene, ARendererThatFailsIsPassedOn) {
  const SceneRenderer broken = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "cut", "train again");
  };
  const auto painted = painted_scene(broken, {at(0)}, {thermal_of(at(0))}, {}, {});
  ASSERT_FALSE(painted);
  EXPECT_EQ(painted.error().where, "field");
}

void add_tracking(OrbitViews& orbit, RenderAlignment& alignment, double nominal_deg,
                  const cv::Mat& image) {
  RenderAlignedView view;
  view.view = at(0);
  alignment.views.push_back(view);
  orbit.images.push_back(image);
  Station station;
  station.azimuth_deg = nominal_deg;
  orbit.stations.push_back(station);
}

/// Stations every 30 deg, as posed.
void add_stations(OrbitViews& orbit, RenderAlignment& alignment) {
  for (int i = 0; i < 12; ++i) {
    RenderAlignedView view;
    view.view = at(30 * i), view.agreement = 0.5, view.matches = 200;
    orbit.images.push_back(thermal_of(view.view));
    Station station;
    station.azimuth_deg = 30 * i;
    orbit.stations.push_back(station);
    alignment.views.push_back(view);
  }
}

TEST(PaintedScene, APainterDoesNotJudgeItself) {
  const SceneRenderer form = testing_orbit::box_renderer();
  PaintedSceneOptions options;
  options.min_turn_deg = 8;
  const auto painted = painted_scene(form, {at(0)}, {thermal_of(at(0))}, options, {});
  ASSERT_TRUE(painted);
  const auto own = (*painted)(at(3).camera, at(3).cam_from_world);
  ASSERT_TRUE(own);
  for (const float value : cv::Mat1f(own->brightness)) EXPECT_TRUE(std::isnan(value));
  const auto other = (*painted)(at(20).camera, at(20).cam_from_world);
  ASSERT_TRUE(other);
  EXPECT_GT(cv::countNonZero(other->brightness == other->brightness), 1000);
}

double off_deg(const RenderAlignedView& view, const PosedView& truth) {
  return rotation_angle_deg(view.view.cam_from_world.rotation, truth.cam_from_world.rotation);
}

TEST(CorrectByTemperatures, AViewOnTheWrongRibGoesHomeAndTheOthersStay) {
  OrbitViews orbit;
  RenderAlignment alignment;
  add_stations(orbit, alignment);
  alignment.views[4].view = at(129);
  alignment.views[9].view = at(270, 20);
  const SceneRenderer form = testing_orbit::box_renderer();
  const Progress progress;
  const auto check = correct_by_temperatures({form, orbit, progress}, alignment);
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_GE(check->moved, 2);
  EXPECT_EQ(check->undecided, 0);
  for (int i = 0; i < 12; ++i)
    EXPECT_LT(off_deg(alignment.views[static_cast<std::size_t>(i)], at(30 * i)), 1.0) << i;
}

TEST(CorrectByTemperatures, OnlyTemperaturesThatFindAViewMoveIt) {
  // Found there: it goes, with form or without.
  EXPECT_EQ(who_places({true, 0.8, 0.9, 1.0}), MoveDecision::both);
  EXPECT_EQ(who_places({false, 0.8, 0.3, 1.0}), MoveDecision::temperatures_alone);
  // Weakly, but form likes it better there too.
  EXPECT_EQ(who_places({true, 0.3, 0.9, 0.5}), MoveDecision::both);
  // Neither scene knows it there: agreeing on nothing moves nobody.
  EXPECT_EQ(who_places({true, 0, 0, 0}), MoveDecision::nobody);
  EXPECT_EQ(who_places({true, 0.03, 0.05, 0.04}), MoveDecision::nobody);
  EXPECT_EQ(who_places({true, 0.3, 0.59, 0.5}), MoveDecision::nobody);
  EXPECT_EQ(who_places({true, 0.3, 0.61, 0.5}), MoveDecision::both);
  // Searched as a whole and found where it was: weak, but nothing speaks against it.
  EXPECT_EQ(who_places({true, 0.51, 0.50, 0.47, true}), MoveDecision::both);
  EXPECT_EQ(who_places({true, 0.51, 0.50, 0.47, false}), MoveDecision::nobody);
  EXPECT_EQ(who_places({true, 0.2, 0.50, 0.47, true}), MoveDecision::nobody);
  // Found nowhere; that both scenes agree on a place where neither knows it says nothing.
  EXPECT_EQ(who_places({true, 0.03, 0.2, 0.7}), MoveDecision::form_alone);
  EXPECT_EQ(who_places({false, 0.03, 0.2, 0.7}), MoveDecision::form_alone);
  // Half found elsewhere: the place that form knows better stays, in doubt.
  EXPECT_EQ(who_places({false, 0.55, 0.2, 0.7}), MoveDecision::form_alone);
  EXPECT_EQ(who_places({true, 0.58, 0.51, 0.92}), MoveDecision::form_alone);
  // Half found elsewhere where form knows it better, or known to neither: nobody's word.
  EXPECT_EQ(who_places({false, 0.55, 0.8, 0.7}), MoveDecision::nobody);
  EXPECT_EQ(who_places({false, 0.1, 0.2, 0.4}), MoveDecision::nobody);
  EXPECT_EQ(who_places({}), MoveDecision::nobody);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(who_places({false, nan, nan, nan}), MoveDecision::nobody);
}

TEST(PlaceEvidence, AViewMovedAgainstFormIsNotSure) {
  const PlaceEvidence apart{false, 0.8, 0.3, 1.0};
  EXPECT_EQ(verdict_of_move(MoveDecision::temperatures_alone, apart, 3, true).reason,
            DoubtReason::temperatures_elsewhere);
  // Where it was all along, or where form knows it better than before, both agree.
  EXPECT_TRUE(verdict_of_move(MoveDecision::temperatures_alone, apart, 0.2, false).sure());
  EXPECT_TRUE(verdict_of_move(MoveDecision::both, {true, 0.8, 0.9, 0.5}, 3, true).sure());
  EXPECT_FALSE(verdict_of_move(MoveDecision::both, {true, 0.8, 0.5, 0.9}, 3, true).sure());
  EXPECT_EQ(verdict_of_move(MoveDecision::form_alone, {false, 0.1, 0.2, 0.9}, 0, false).reason,
            DoubtReason::temperatures_contradict);
}

TEST(CorrectByTemperatures, WhatNobodyPlacesIsLeftToPatchesOnlyWhereItLooksRight) {
  const auto confidence = [](bool agree, double apart_deg, double likeness) {
    return verdict_of_unplaced(agree, apart_deg, likeness).confidence;
  };
  EXPECT_EQ(confidence(true, 0.1, 0.98), Confidence::doubtful);
  EXPECT_FALSE(verdict_of_unplaced(true, 0.1, 0.98).on_probation);
  EXPECT_EQ(confidence(true, 0.1, 0.90), Confidence::doubtful);
  EXPECT_TRUE(verdict_of_unplaced(true, 0.1, 0.90).on_probation);
  EXPECT_TRUE(verdict_of_unplaced(false, 2.7, 0.90).on_probation);
  EXPECT_EQ(confidence(true, 0.1, 0.60), Confidence::dropped);
  EXPECT_EQ(confidence(false, 2.7, 0.98), Confidence::doubtful);
  EXPECT_EQ(confidence(false, 2.7, 0.60), Confidence::dropped);
  EXPECT_EQ(confidence(false, 1.1, 0.20), Confidence::doubtful) << "not two places";
  EXPECT_EQ(confidence(false, 2.7, std::numeric_limits<double>::quiet_NaN()), Confidence::dropped);
  EXPECT_EQ(verdict_of_unplaced(true, 0.1, 0).reason, DoubtReason::not_found);
  EXPECT_EQ(verdict_of_unplaced(false, 9, 0).reason, DoubtReason::temperatures_elsewhere);
}

TEST(CorrectByTemperatures, SharesOfNothingSayNothing) {
  EXPECT_DOUBLE_EQ(share_of_median(30, 40), 0.75);
  EXPECT_EQ(share_of_median(0, 0), 0);
  EXPECT_EQ(share_of_median(5, 0), 0);
}

TEST(CorrectByTemperatures, AViewKeptByFormAloneCarriesTheObjection) {
  // Temperatures find it nowhere; what form said of it before decides.
  for (const bool known_to_form : {true, false}) {
    OrbitViews orbit;
    RenderAlignment alignment;
    add_stations(orbit, alignment);
    orbit.images[4] = cv::Scalar(0.5);
    if (!known_to_form) alignment.views[4].agreement = 0;
    const SceneRenderer form = testing_orbit::box_renderer();
    const Progress progress;
    const OrbitRefinement refinement{form, orbit, progress};
    const auto check = correct_by_temperatures(refinement, alignment);
    ASSERT_TRUE(check) << check.error().message();
    EXPECT_EQ(check->undecided, 0);
    EXPECT_EQ(off_deg(alignment.views[4], at(120)), 0);
    ASSERT_TRUE(refinement.together(alignment, {0, 1e-4}, {judging_rounds().front()}));
    for (std::size_t i = 0; i < 12; ++i)
      EXPECT_EQ(alignment.views[i].verdict.reason == DoubtReason::temperatures_contradict,
                i == 4 && known_to_form)
          << i;
    EXPECT_EQ(alignment.views[4].verdict.confidence,
              known_to_form ? Confidence::doubtful : Confidence::dropped);
    const std::string& told = alignment.views[4].verdict.detail;
    EXPECT_EQ(told.find("1.00 of its loop") != std::string::npos, known_to_form) << told;
  }
}

TEST(TakeVerdicts, DoubtfulViewsAreKeptNamedAndCountedAndDroppedOnesAreNot) {
  PlacedViews placed;
  for (const Confidence confidence : {Confidence::sure, Confidence::doubtful, Confidence::dropped})
    placed.views.push_back(
        {at(0), {confidence, DoubtReason::temperatures_unlike, "at 0.42 only"}, 0.2, 0.5});
  placed.views[1].view.name = "t004.tiff";
  placed.views[2].view.name = "t009.tiff";
  placed.warnings = {"loop 0 as a whole is in doubt"};
  ModalityPoses poses;
  poses.frame_count = 3;
  take_verdicts(placed, poses);
  EXPECT_EQ(poses.reconstruction.views.size(), 2u);
  ASSERT_EQ(poses.doubtful.size(), 1u);
  EXPECT_EQ(poses.doubtful[0].name, "t004.tiff");
  EXPECT_EQ(poses.doubtful[0].reason, DoubtReason::temperatures_unlike);
  ASSERT_EQ(poses.dropped.size(), 1u);
  EXPECT_EQ(poses.dropped[0].name, "t009.tiff");
  EXPECT_EQ(poses.gates.at("views_sure"), 1);
  EXPECT_EQ(poses.gates.at("views_doubtful"), 1);
  EXPECT_EQ(poses.warnings, placed.warnings);
}

TEST(CorrectByTemperatures, WhereMostAreContradictedNoneGoes) {
  OrbitViews orbit;
  RenderAlignment alignment;
  add_stations(orbit, alignment);
  for (std::size_t i = 0; i < 12; ++i)
    if (i % 4 != 0) alignment.views[i].view = at(30.0 * static_cast<double>(i) + 40, 35);
  const RenderAlignment before = alignment;
  const SceneRenderer form = testing_orbit::box_renderer();
  const Progress progress;
  const auto check = correct_by_temperatures({form, orbit, progress}, alignment);
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_EQ(check->moved, 0);
  EXPECT_GT(check->undecided, 6);
  int doubted = 0;
  for (const RenderAlignedView& view : alignment.views)
    doubted += view.verdict.reason == DoubtReason::undecided ? 1 : 0;
  EXPECT_EQ(doubted, check->undecided) << "kept, but not in silence";
  for (std::size_t i = 0; i < 12; ++i)
    EXPECT_EQ(off_deg(alignment.views[i], before.views[i].view), 0) << i;
}

TEST(CorrectByTemperatures, WhatWasContradictedAndPatchesDontConfirmIsInDoubt) {
  const auto doubted = [](int contradicted, int patches) {
    OrbitViews orbit;
    RenderAlignment alignment;
    add_stations(orbit, alignment);
    for (RenderAlignedView& view : alignment.views) view.confirmed_patches = patches;
    alignment.views[3].verdict = {Confidence::dropped, DoubtReason::not_found, "nowhere"};
    doubt_unconfirmed(contradicted, alignment);
    EXPECT_EQ(alignment.views[3].verdict.confidence, Confidence::dropped);
    return std::count_if(alignment.views.begin(), alignment.views.end(), [](const auto& view) {
      return view.verdict.reason == DoubtReason::undecided;
    });
  };
  EXPECT_EQ(doubted(5, 19), 11) << "statue with rolled cameras: 10 of 24, 19 patches, 11 % off";
  EXPECT_EQ(doubted(5, 33), 0);
  EXPECT_EQ(doubted(3, 19), 0);
  Fit none;
  doubt_unconfirmed(0, none);
}

TEST(AddViews, OnlyFramesThatBothScenesPlaceAlikeAreConfirmed) {
  OrbitViews orbit;
  RenderAlignment alignment;
  add_stations(orbit, alignment);
  add_tracking(orbit, alignment, 20, thermal_of(at(22, 13)));
  add_tracking(orbit, alignment, 50, thermal_of(at(48, 16)));
  // A frame of noise fits anywhere as badly as elsewhere.
  cv::Mat noise(240, 320, CV_32F);
  cv::theRNG().state = 7;
  cv::randu(noise, 0, 1);
  add_tracking(orbit, alignment, 80, noise);
  // One taken far from where its order has it.
  add_tracking(orbit, alignment, 110, thermal_of(at(60, 40)));
  ASSERT_TRUE(add_views(testing_orbit::box_renderer(), orbit, 12, alignment, {}));
  EXPECT_TRUE(alignment.views[12].verdict.sure());
  EXPECT_TRUE(alignment.views[13].verdict.sure());
  EXPECT_EQ(alignment.views[14].verdict.confidence, Confidence::dropped);
  // Found or doubted, but not kept where it was not taken.
  const double away = rotation_angle_deg(alignment.views[15].view.cam_from_world.rotation,
                                         at(60, 40).cam_from_world.rotation);
  EXPECT_TRUE(away < 1 || !alignment.views[15].verdict.sure()) << away;
  EXPECT_LT(rotation_angle_deg(alignment.views[12].view.cam_from_world.rotation,
                               at(22, 13).cam_from_world.rotation),
            0.5);
}

}  // namespace
}  // namespace orbitfuse
