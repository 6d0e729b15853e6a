// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/guided_matching.hpp"

#include <gtest/gtest.h>

#include <set>

#include "core/geometry/rotation_vector.hpp"
#include "recon/poses/sfm/bundle_adjustment.hpp"
#include "tests/recon/poses/feature_scene.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::FeatureScene;

/// The truth's poses, each turned and shifted a little, on a third of the right matches.
Reconstruction rough_model(const FeatureScene& scene, double turn_rad, double shift) {
  std::mt19937 rng(11);
  std::normal_distribution<double> normal(0, 1);
  const auto random = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
  PosedFrames posed{FramePoses(scene.truth.size()), scene.graph.cameras};
  for (std::size_t v = 0; v < scene.truth.size(); ++v) {
    Rigid3d pose = scene.truth[v].cam_from_world;
    pose.rotation = turned_by(turn_rad * random()) * pose.rotation;
    pose.translation += shift * random();
    posed.poses[v] = pose;
  }
  PairMatches few;
  for (const auto& [pair, matches] : scene.graph.proposed)
    for (std::size_t i = 0; i < matches.size(); i += 3) few[pair].push_back(matches[i]);
  return reconstruction_of(scene.graph, posed,
                           triangulate_tracks(scene.graph, few, posed, TrackOptions{}),
                           Modality::visible);
}

Reconstruction settled(Reconstruction model) {
  const std::vector<int> one_lens(model.views.size(), 0);
  const auto report = adjust_bundle(model, one_lens, {LensGroup{600, 0.001, false, false}}, {});
  EXPECT_TRUE(report) << report.error().message();
  return model;
}

/// Share of the tracks that show one scene point.
double right_share(const FeatureScene& scene, const Reconstruction& model) {
  std::size_t right = 0;
  for (const SparsePoint& point : model.points) {
    std::set<int> shown;
    for (const Observation& o : point.track) {
      const auto v = static_cast<std::size_t>(o.view);
      for (Eigen::Index i = 0; i < scene.graph.pixels[v].cols(); ++i)
        if (scene.graph.pixels[v].col(i) == o.pixel)
          shown.insert(scene.point_of[v][static_cast<std::size_t>(i)]);
    }
    right += shown.size() == 1;
  }
  return static_cast<double>(right) / static_cast<double>(model.points.size());
}

TEST(GuidedMatching, AModelFindsMoreMatchesAlongItsOwnLinesAndPosesComeNearer) {
  const FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction before = settled(rough_model(scene, 0.0005, 0.002));
  const Reconstruction again = rematched(scene.graph, before);
  ASSERT_EQ(again.views.size(), before.views.size());
  // Points alone do not tell: matches that meet make one long track of several short ones.
  EXPECT_GT(observations_a_view(again), 1.5 * observations_a_view(before));
  EXPECT_GT(right_share(scene, again), 0.97);
  EXPECT_LT(testing_orbit::worst_center(settled(again), scene.truth),
            0.8 * testing_orbit::worst_center(before, scene.truth));
}

TEST(GuidedMatching, PairsWhoseLinesFindTooLittleKeepWhatTheyHad) {
  const FeatureScene scene = testing_orbit::described_scene();
  const PosedFrames posed = posed_frames(scene.graph, rough_model(scene, 0.05, 0.2));
  PairMatches matches = scene.graph.proposed;
  match_along_lines(scene.graph, posed, 1, matches);
  int kept = 0;
  for (const auto& [pair, had] : scene.graph.proposed) {
    EXPECT_GE(2 * matches.at(pair).size(), had.size()) << pair.first << " " << pair.second;
    kept += matches.at(pair) == had;
  }
  EXPECT_GT(kept, static_cast<int>(scene.graph.proposed.size()) / 2);
}

TEST(GuidedMatching, TheLargestOfSeveralPartsIsFound) {
  EXPECT_EQ(largest_part(6, {{0, 1}, {2, 4}, {4, 5}}),
            (std::vector<bool>{false, false, true, false, true, true}));
  EXPECT_EQ(largest_part(2, {}), (std::vector<bool>{true, false}));
}

TEST(GuidedMatching, AFrameIsPutWhereTheOthersPointsHaveIt) {
  const FeatureScene scene = testing_orbit::described_scene();
  PosedFrames posed = posed_frames(scene.graph, rough_model(scene, 0, 0));
  const Rigid3d truth = *posed.poses[5];
  posed.poses[5]->translation += Eigen::Vector3d(0.02, -0.01, 0.02);
  pose_by_others(scene.graph, scene.graph.proposed, posed);
  EXPECT_LT((camera_center(*posed.poses[5]) - camera_center(truth)).norm(), 0.01);
}

TEST(GuidedMatching, FramesThatHoldNoOtherLoseTheirPose) {
  const FeatureScene scene = testing_orbit::described_scene();
  PosedFrames posed = posed_frames(scene.graph, rough_model(scene, 0, 0));
  PairMatches matches = scene.graph.proposed;
  std::erase_if(matches,
                [](const auto& of) { return of.first.first == 3 || of.first.second == 3; });
  const auto as_it_is = [](Reconstruction model) -> Result<Reconstruction> { return model; };
  const auto model = adjusted(scene.graph, matches, 3, posed, as_it_is);
  ASSERT_TRUE(model) << model.error().message();
  EXPECT_EQ(model->views.size(), scene.truth.size() - 1);
  EXPECT_FALSE(posed.poses[3]);
  EXPECT_FALSE(adjusted(scene.graph, {}, 3, posed, as_it_is));
}

TEST(GuidedMatching, ViewsWithoutFeaturesAreNoFailure) {
  FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction model = rough_model(scene, 0, 0);
  for (std::size_t v = 0; v < scene.graph.pixels.size(); ++v) {
    scene.graph.pixels[v].resize(2, 0);
    scene.graph.descriptors[v].resize(0, 128);
  }
  scene.graph.proposed.clear();
  EXPECT_TRUE(rematched(scene.graph, model).points.empty());
}

}  // namespace
}  // namespace orbitfuse
