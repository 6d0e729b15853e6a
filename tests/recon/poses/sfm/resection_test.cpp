// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/resection.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "recon/poses/sfm/held_matches.hpp"
#include "tests/recon/poses/feature_scene.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::described_scene;
using testing_orbit::FeatureScene;

PosedFrames posed_but(const FeatureScene& scene, const std::vector<int>& left_out) {
  PosedFrames posed{FramePoses(scene.truth.size()), scene.graph.cameras};
  for (std::size_t v = 0; v < scene.truth.size(); ++v)
    posed.poses[v] = scene.truth[v].cam_from_world;
  for (const int v : left_out) posed.poses[static_cast<std::size_t>(v)].reset();
  return posed;
}

TEST(Resection, ViewsLeftOutFindTheirPlace) {
  FeatureScene scene = described_scene();
  PosedFrames posed = posed_but(scene, {3, 4, 17});
  const auto added = resect(scene.graph, posed, {}, {});
  ASSERT_TRUE(added) << added.error().message();
  EXPECT_EQ(added->size(), 3u);
  for (const std::size_t v : {3u, 4u, 17u}) {
    ASSERT_TRUE(posed.poses[v]) << v;
    EXPECT_LT(
        (camera_center(*posed.poses[v]) - camera_center(scene.truth[v].cam_from_world)).norm(),
        0.04)
        << v;
    EXPECT_LT(posed.poses[v]->rotation.angularDistance(scene.truth[v].cam_from_world.rotation),
              0.01)
        << v;
  }
  EXPECT_TRUE(scene.graph.verified.contains({3, 4}))
      << "its guided matches hold it in the adjustment";
}

TEST(Resection, AViewOfSomethingElseOrOfNothingGetsNoPose) {
  FeatureScene scene = described_scene();
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> pixel(0, 480);
  for (Eigen::Index i = 0; i < scene.graph.pixels[7].cols(); ++i)
    scene.graph.pixels[7].col(i) = Eigen::Vector2d(pixel(rng), pixel(rng));
  scene.graph.pixels[9].resize(2, 0);
  scene.graph.descriptors[9].resize(0, 128);
  for (auto* list : {&scene.graph.proposed, &scene.graph.verified})
    std::erase_if(
        *list, [](const auto& entry) { return entry.first.first == 9 || entry.first.second == 9; });
  PosedFrames posed = posed_but(scene, {7, 9});
  const auto added = resect(scene.graph, posed, {}, {});
  ASSERT_TRUE(added) << added.error().message();
  EXPECT_TRUE(added->empty());
}

TEST(Resection, AFrameHeldByItsOwnLinesGoesWhereTheOthersHaveIt) {
  const FeatureScene scene = described_scene();
  PosedFrames posed = posed_but(scene, {});
  const Rigid3d right = *posed.poses[5];
  // Two degrees aside on the orbit, and matches along the lines of that place.
  Rigid3d aside = right;
  aside.rotation = right.rotation * Eigen::AngleAxisd(0.035, Eigen::Vector3d::UnitZ());
  posed.poses[5] = aside;
  PairMatches matches = scene.graph.verified;
  for (auto& [pair, list] : matches)
    if (pair.first == 5 || pair.second == 5) list = guided_matches(scene.graph, pair, posed, 6);
  ASSERT_GT((camera_center(aside) - camera_center(right)).norm(), 0.02);

  const auto found = resect_by_others(
      scene.graph, triangulate_tracks(scene.graph, matches, posed, {}), posed, 5, {});
  ASSERT_TRUE(found);
  EXPECT_LT((camera_center(*found) - camera_center(right)).norm(), 0.01);
  EXPECT_LT(found->rotation.angularDistance(right.rotation), 0.003);
}

TEST(Resection, WithoutMatchesOfItsOwnAFrameStaysWhereItIs) {
  FeatureScene scene = described_scene();
  const PosedFrames posed = posed_but(scene, {});
  const auto tracks = triangulate_tracks(scene.graph, scene.graph.verified, posed, {});
  std::erase_if(scene.graph.proposed, [](const auto& entry) {
    return entry.first.first == 9 || entry.first.second == 9;
  });
  EXPECT_FALSE(resect_by_others(scene.graph, tracks, posed, 9, {}));
}

TEST(Tracks, OfTheOtherFramesAloneDoNotFollowTheOneLeftOut) {
  const FeatureScene scene = described_scene();
  const PosedFrames right = posed_but(scene, {});
  const auto tracks = triangulate_tracks(scene.graph, scene.graph.verified, right, {});
  PosedFrames aside = right;
  aside.poses[5]->translation.x() += 0.3;
  const auto others = without_frame(scene.graph, aside, tracks, 5);
  ASSERT_FALSE(others.empty());
  EXPECT_LT(others.size(), tracks.size()) << "tracks of two frames that are left with one";
  for (const FeatureTrack& track : others) {
    EXPECT_GE(track.features.size(), 2u);
    for (const auto& [f, i] : track.features) {
      EXPECT_NE(f, 5);
      const auto v = static_cast<std::size_t>(f);
      const Eigen::Vector2d pixel =
          scene.graph.cameras[v].project(*right.poses[v] * track.position);
      EXPECT_LT((pixel - scene.graph.pixels[v].col(i)).norm(), 4);
    }
  }
}

TEST(Tracks, MatchesContradictAnOrbitThatIsTornApart) {
  const FeatureScene scene = described_scene();
  const PosedFrames right = posed_but(scene, {});
  EXPECT_FALSE(held_matches(scene.graph, right).contradict());
  // The quarters of each loop, turned about the object: every residual within a quarter stays.
  PosedFrames torn = right;
  for (std::size_t f = 0; f < torn.poses.size(); ++f) {
    const double turn = 0.4 * static_cast<double>(f % 12 / 3);
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
    torn.poses[f] = *torn.poses[f] * Rigid3d{rotation, Eigen::Vector3d::Zero()};
  }
  const HeldMatches held = held_matches(scene.graph, torn);
  EXPECT_TRUE(held.contradict()) << held.share << " " << held.contradicted;
  EXPECT_GT(held.share, 0.5) << "most neighbours are in one quarter";
}

/// Of each frame of a loop with the one four on, 30 matches that mean nothing: a ring's marks, one
/// for another.
void add_repeated_pattern(FeatureScene& scene) {
  for (int f = 0; f + 4 < 12; ++f) {
    std::vector<FeatureMatch>& matches = scene.graph.verified[{f, f + 4}];
    matches.clear();
    const auto features = static_cast<int>(scene.graph.pixels[static_cast<std::size_t>(f)].cols()),
               there = static_cast<int>(scene.graph.pixels[static_cast<std::size_t>(f + 4)].cols());
    for (int i = 0; i < 30; ++i) matches.emplace_back(i * features / 30, (17 * i + 5) % there);
  }
}

TEST(Tracks, ARepeatedPatternIsOutvotedByTheMatchesThatJoinItsFrames) {
  FeatureScene scene = described_scene();
  add_repeated_pattern(scene);
  const PosedFrames right = posed_but(scene, {});
  const HeldMatches held = held_matches(scene.graph, right);
  EXPECT_EQ(held.outvoted, 8);
  EXPECT_EQ(held.contradicted, 0);
  // A frame that nothing but its own matches places has nobody to vote for it.
  PosedFrames astray = right;
  const Eigen::Quaterniond aside(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
  astray.poses[5] = *right.poses[5] * Rigid3d{aside, Eigen::Vector3d::Zero()};
  EXPECT_TRUE(held_matches(scene.graph, astray).contradict());
}

TEST(Tracks, TheRightPosesExplainMoreMatchesThanFoldedOnes) {
  const FeatureScene scene = described_scene();
  const PosedFrames right = posed_but(scene, {});
  PosedFrames folded = right;
  std::swap(folded.poses[2], folded.poses[8]);
  const int explained = explained_matches(scene.graph, right);
  EXPECT_GT(explained, 1000);
  EXPECT_LT(explained_matches(scene.graph, folded), 0.9 * explained);
  EXPECT_GT(held_matches(scene.graph, right).share, 0.98);
  EXPECT_LT(held_matches(scene.graph, folded).share, 0.95);
  EXPECT_EQ(held_matches(scene.graph, {FramePoses(24), scene.graph.cameras}).share, 1)
      << "no pair says no";
  EXPECT_EQ(explained_matches(scene.graph, {FramePoses(24), scene.graph.cameras}), 0);
}

TEST(Tracks, AreTriangulatedWhereTheTruthIs) {
  const FeatureScene scene = described_scene();
  const auto tracks =
      triangulate_tracks(scene.graph, scene.graph.verified, posed_but(scene, {}), {});
  ASSERT_GT(tracks.size(), 200u);
  int longer = 0;
  for (const FeatureTrack& track : tracks) {
    longer += track.features.size() >= 3 ? 1 : 0;
    std::set<int> points;
    for (const auto& [f, i] : track.features)
      points.insert(scene.point_of[static_cast<std::size_t>(f)][static_cast<std::size_t>(i)]);
    EXPECT_EQ(points.size(), 1u);
  }
  EXPECT_GT(longer, 100);
}

}  // namespace
}  // namespace orbitfuse
