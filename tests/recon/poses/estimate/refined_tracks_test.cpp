// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/refined_tracks.hpp"

#include <gmock/gmock.h>

#include "tests/recon/poses/feature_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;
using testing_orbit::seen_cube;
using testing_orbit::two_loops;

std::vector<cv::Mat> constant_images(const Reconstruction& model) {
  std::vector<cv::Mat> images;
  for (const PosedView& view : model.views)
    images.emplace_back(view.camera.height, view.camera.width, CV_32F, cv::Scalar(90));
  return images;
}

TEST(RefinedTracks, ModelsWhosePatchesAreNotFoundStayAsTheyAre) {
  // Each view keeps what it had, having nothing else: that is no alignment.
  const Reconstruction model = seen_cube(two_loops(), 100, 0.3);
  ASSERT_TRUE(holds_all_views(model));
  const auto refined = aligned_model(model, constant_images(model), {});
  ASSERT_TRUE(refined);
  EXPECT_FALSE(refined->model);
  EXPECT_THAT(refined->found, HasSubstr("0 % moved"));
}

TEST(RefinedTracks, AModelWithDoubtfulViewsIsNotAligned) {
  Reconstruction model = seen_cube(two_loops(), 100, 0.3);
  for (std::size_t i = 20; i < model.points.size(); ++i)
    std::erase_if(model.points[i].track, [](const Observation& seen) { return seen.view == 7; });
  ASSERT_FALSE(holds_all_views(model));
  const auto refined = aligned_model(model, constant_images(model), {});
  ASSERT_TRUE(refined);
  EXPECT_FALSE(refined->model);
  EXPECT_THAT(refined->found, HasSubstr("in doubt"));
}

TEST(RefinedTracks, TooManyObservationsAreLeftAlone) {
  const Reconstruction model = seen_cube(two_loops(), 9000, 0.3);
  const auto refined = aligned_model(model, {}, {});
  ASSERT_TRUE(refined);
  EXPECT_FALSE(refined->model);
  EXPECT_THAT(refined->found, HasSubstr("too many"));
}

/// A scene's machine, whose features all match as they should.
testing_orbit::FeatureScene plain_scene() {
  testing_orbit::FeatureScene scene =
      testing_orbit::FeatureSceneMaker({.wrong_pillar = 0, .false_matches = 0}).make();
  scene.graph.verified = scene.graph.proposed;
  return scene;
}

Reconstruction posed_by(const std::vector<PosedView>& views) {
  Reconstruction model;
  model.views = views;
  return model;
}

/// Two neighbours and the view above them, carried off along the orbit.
std::vector<PosedView> with_a_block_off(std::vector<PosedView> views, double off_deg) {
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(off_deg * EIGEN_PI / 180, Eigen::Vector3d::UnitZ()));
  for (const std::size_t v : {3, 4, 15})
    views[v].cam_from_world = views[v].cam_from_world * Rigid3d{turn, Eigen::Vector3d::Zero()};
  return views;
}

double adjusted_error(Reconstruction& model, const Reconstruction& truth) {
  const std::vector<int> group(model.views.size(), 0);
  LensGroup lens;
  lens.focal_px = model.views[0].camera.fx;
  EXPECT_TRUE(adjust_bundle(model, group, {lens}, {}));
  return farthest_move(model, truth);
}

TEST(RefinedTracks, AllMatchesDrawBackABlockThatStoodElsewhere) {
  const testing_orbit::FeatureScene scene = plain_scene();
  const Reconstruction truth = posed_by(scene.truth);
  // As a mapper leaves it: its points are those that fit the block's place.
  const Reconstruction off = posed_by(with_a_block_off(scene.truth, 10));
  Reconstruction model = triangulated(scene.graph, posed_frames(scene.graph, off));
  const double as_left = adjusted_error(model, truth);
  EXPECT_GT(as_left, 0.003);
  model = triangulated_again(scene.graph, model);
  EXPECT_LT(adjusted_error(model, truth), 0.3 * as_left);
}

double observations(const Reconstruction& model) {
  double seen = 0;
  for (const SparsePoint& point : model.points) seen += static_cast<double>(point.track.size());
  return seen;
}

TEST(RefinedTracks, MatchesThatNoGeometryVerifiedAreTakenWhereThePlacesConfirmThem) {
  testing_orbit::FeatureScene scene = plain_scene();
  const PosedFrames posed = posed_frames(scene.graph, posed_by(scene.truth));
  const double of_all = observations(triangulated(scene.graph, posed));
  for (auto& [pair, matches] : scene.graph.verified) matches.resize(matches.size() / 3);
  const double of_verified = observations(triangulated(scene.graph, posed));
  EXPECT_LT(of_verified, 0.7 * of_all);
  const Reconstruction again = triangulated_again(scene.graph, posed_by(scene.truth));
  EXPECT_GT(observations(again), 0.95 * of_all);
}

TEST(RefinedTracks, MovesAreThoseWithinTheModelWhateverItsFrame) {
  const std::vector<PosedView> views = two_loops();
  std::vector<PosedView> elsewhere = views;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(2, Eigen::Vector3d(1, 2, 3).normalized()));
  for (PosedView& view : elsewhere) {
    view.cam_from_world = view.cam_from_world * Rigid3d{turn, Eigen::Vector3d(4, -5, 6)};
    view.cam_from_world.translation *= 1e3;
  }
  EXPECT_LT(farthest_move(posed_by(elsewhere), posed_by(views)), 1e-9);
  elsewhere[5].cam_from_world.translation += Eigen::Vector3d(0, 0, 100);
  EXPECT_GT(farthest_move(posed_by(elsewhere), posed_by(views)), 0.01);

  EXPECT_EQ(farthest_move(posed_by({views[0], views[1]}), posed_by(views)), 0);
  EXPECT_EQ(farthest_move(posed_by({}), posed_by({})), 0);
  EXPECT_EQ(farthest_move(posed_by(std::vector(4, views[0])), posed_by({views[0]})), 0);
}

}  // namespace
}  // namespace orbitfuse
