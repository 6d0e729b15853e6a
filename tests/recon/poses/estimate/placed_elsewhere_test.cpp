// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/placed_elsewhere.hpp"

#include <gmock/gmock.h>

#include <atomic>

#include "recon/poses/sfm/guided_matching.hpp"
#include "tests/recon/poses/feature_scene.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;
using testing_orbit::FeatureScene;

/// The truth, but for view 5, turned about the object; its points are those along its own lines.
Reconstruction with_a_view_aside(const FeatureScene& scene, double turn_rad) {
  PosedFrames posed{FramePoses(scene.truth.size()), scene.graph.cameras};
  for (std::size_t v = 0; v < scene.truth.size(); ++v)
    posed.poses[v] = scene.truth[v].cam_from_world;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()));
  posed.poses[5] = *posed.poses[5] * Rigid3d{turn, Eigen::Vector3d::Zero()};
  PairMatches matches = matches_along_own_lines(scene.graph, posed);
  return reconstruction_of(scene.graph, posed,
                           triangulate_tracks(scene.graph, matches, posed, TrackOptions{}),
                           Modality::visible);
}

TEST(PlacedElsewhere, AViewThatItsOwnLinesHoldAsideIsNamedAndNoOther) {
  const FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction aside = with_a_view_aside(scene, 0.05);
  std::size_t points = 0;
  for (const SparsePoint& point : aside.points)
    for (const Observation& o : point.track) points += o.view == 5;
  EXPECT_GT(points, 30u) << "so many points hold it where it is";
  const auto named = placed_elsewhere(scene.graph, aside, {});
  ASSERT_TRUE(named);
  ASSERT_EQ(named->size(), 1u);
  EXPECT_EQ(named->front().name, scene.truth[5].name);
  EXPECT_EQ(named->front().reason, DoubtReason::neighbours_elsewhere);
  EXPECT_THAT(named->front().why, HasSubstr("of its matches agree, here"));
}

TEST(PlacedElsewhere, RightViewsAreNotNamedHoweverFewMatchesTheyHold) {
  FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction right = with_a_view_aside(scene, 0);
  // Two matches of five are false, as of a view of repeated structure.
  for (auto& [pair, matches] : scene.graph.proposed)
    for (std::size_t i = 0; i + 7 < matches.size(); i += 5)
      std::swap(matches[i].second, matches[i + 7].second);
  scene.graph.verified = scene.graph.proposed;
  const auto named = placed_elsewhere(scene.graph, right, {});
  ASSERT_TRUE(named);
  EXPECT_TRUE(named->empty()) << named->front().why;
}

TEST(PlacedElsewhere, StopsWhenAsked) {
  const FeatureScene scene = testing_orbit::described_scene();
  const std::atomic<bool> stop = true;
  Progress stopping;
  stopping.cancel = &stop;
  const auto stopped = placed_elsewhere(scene.graph, with_a_view_aside(scene, 0.05), stopping);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace orbitfuse
