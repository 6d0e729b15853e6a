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

/// Half of what view 5 matches (two thirds of what is in its points) where it would be from another
/// place: its matches leave open which of the two it is.
FeatureScene with_a_view_of_two_places(double turn_rad) {
  FeatureScene scene = testing_orbit::described_scene();
  const Reconstruction truth = with_a_view_aside(scene, 0);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()));
  const PosedView& here = scene.truth[5];
  const Rigid3d there = here.cam_from_world * Rigid3d{turn, Eigen::Vector3d::Zero()};
  for (const SparsePoint& point : truth.points)
    for (const Observation& o : point.track) {
      if (o.view != 5) continue;
      Eigen::Index feature = 0;
      Eigen::Matrix2Xd& pixels = scene.graph.pixels[5];
      (pixels.colwise() - o.pixel).colwise().squaredNorm().minCoeff(&feature);
      if (feature % 3 != 0)
        pixels.col(feature) += here.camera.project(there * point.position) -
                               here.camera.project(here.cam_from_world * point.position);
    }
  return scene;
}

TEST(PlacedElsewhere, AViewThatItsMatchesLeaveBetweenTwoPlacesIsNamed) {
  const FeatureScene scene = with_a_view_of_two_places(0.06);
  // Whichever place more agree with, as a model's own lines would hold it in the other.
  std::vector<DoubtfulView> named;
  for (const double turn : {0.0, 0.06}) {
    const auto found = placed_elsewhere(scene.graph, with_a_view_aside(scene, turn), {});
    ASSERT_TRUE(found);
    named.insert(named.end(), found->begin(), found->end());
  }
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named.front().name, scene.truth[5].name);
  EXPECT_THAT(named.front().why, HasSubstr("leave its place open"));
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
