// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/match_rounds.hpp"

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

Reconstruction adjusted(Reconstruction model) {
  const std::vector<int> one_lens(model.views.size(), 0);
  const auto report = adjust_bundle(model, one_lens, {LensGroup{600, 0.001, false, false}}, {});
  EXPECT_TRUE(report) << report.error().message();
  return model;
}

/// Points alone do not tell: matches that meet make one long track of several short ones.
std::size_t observations(const Reconstruction& model) {
  std::size_t count = 0;
  for (const SparsePoint& point : model.points) count += point.track.size();
  return count;
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

TEST(MatchRounds, AModelFindsMoreMatchesAlongItsOwnLinesAndPosesComeNearer) {
  const FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction before = adjusted(rough_model(scene, 0.0005, 0.002));
  const Reconstruction again = match_again(scene.graph, before);
  ASSERT_EQ(again.views.size(), before.views.size());
  EXPECT_GT(observations(again), 1.5 * static_cast<double>(observations(before)));
  EXPECT_GT(right_share(scene, again), 0.97);
  EXPECT_LT(testing_orbit::worst_center(adjusted(again), scene.truth),
            0.8 * testing_orbit::worst_center(before, scene.truth));
}

TEST(MatchRounds, WrongPosesFindFewMatchesAndKeepWhatTheyHad) {
  const FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction wrong = rough_model(scene, 0.05, 0.2);
  const PosedFrames posed = posed_frames(scene.graph, wrong);
  PairMatches matches = scene.graph.proposed;
  match_along_lines(scene.graph, posed, 1, matches);
  std::size_t before = 0, after = 0;
  for (const auto& [pair, of_pair] : scene.graph.proposed) before += of_pair.size();
  for (const auto& [pair, of_pair] : matches) after += of_pair.size();
  EXPECT_GT(after, before / 2);
}

TEST(MatchRounds, ViewsWithoutFeaturesAreNoFailure) {
  FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction model = rough_model(scene, 0, 0);
  for (std::size_t v = 0; v < scene.graph.pixels.size(); ++v) {
    scene.graph.pixels[v].resize(2, 0);
    scene.graph.descriptors[v].resize(0, 128);
  }
  scene.graph.proposed.clear();
  EXPECT_TRUE(match_again(scene.graph, model).points.empty());
}

}  // namespace
}  // namespace orbitfuse
