// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/mistaken_pairs.hpp"

#include <gtest/gtest.h>

#include "tests/recon/poses/feature_scene.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::described_scene;
using testing_orbit::FeatureScene;

PosedFrames true_poses(const FeatureScene& scene) {
  PosedFrames posed{{}, scene.graph.cameras};
  for (const PosedView& view : scene.truth) posed.poses.emplace_back(view.cam_from_world);
  return posed;
}

/// Of each frame of a loop with the one `apart` on, matches as if the object had turned along by
/// that much: its sides are alike. Few others join the two.
void add_equal_sides(FeatureScene& scene, int apart) {
  constexpr int points = 60;
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> within(-0.5, 0.5);
  const auto add = [&](int frame, const Rigid3d& cam_from_world, const Eigen::Matrix3Xd& at_side) {
    Eigen::Matrix2Xd& pixels = scene.graph.pixels[static_cast<std::size_t>(frame)];
    const Eigen::Index before = pixels.cols();
    pixels.conservativeResize(2, before + points);
    for (int i = 0; i < points; ++i)
      pixels.col(before + i) = scene.graph.cameras[static_cast<std::size_t>(frame)].project(
          cam_from_world * at_side.col(i));
    return static_cast<int>(before);
  };
  for (int f = 0; f + apart < 12; f += 3) {
    Eigen::Matrix3Xd side(3, points);
    for (int i = 0; i < points; ++i)
      side.col(i) = Eigen::Vector3d(within(rng), within(rng), within(rng));
    const Rigid3d& first = scene.truth[static_cast<std::size_t>(f)].cam_from_world;
    // The next one's place, so that the rays meet; the second frame sees what that one would.
    const Rigid3d& beside = scene.truth[static_cast<std::size_t>(f + 1)].cam_from_world;
    const int of_first = add(f, first, side), of_second = add(f + apart, beside, side);
    std::vector<FeatureMatch>& matches = scene.graph.verified[{f, f + apart}];
    matches.clear();
    for (int i = 0; i < points; ++i) matches.emplace_back(of_first + i, of_second + i);
  }
}

std::optional<StationFit> stations_within(double worst_deg, int views) {
  StationFit fit;
  fit.views = views;
  fit.worst_residual_deg = worst_deg;
  return fit;
}

TEST(MistakenPairs, EqualSidesAreNoWitnessesWhereStationsConfirmTheModel) {
  FeatureScene scene = described_scene();
  // Whoever says that frames 4 apart see one side is off by 90 degrees.
  add_equal_sides(scene, 4);
  const PosedFrames right = true_poses(scene);
  const HeldMatches alone = held_matches(scene.graph, right);
  ASSERT_GT(alone.contradicted + alone.outvoted, 2);
  const auto question = [&](const std::optional<StationFit>& fit) {
    return mistaken_pairs(scene.graph, right, fit, scene.truth.size(), Eigen::Vector3d::UnitZ());
  };
  const auto all = static_cast<int>(scene.truth.size());
  const PairQuestion mistaken = question(stations_within(8, all));
  ASSERT_TRUE(mistaken);
  for (int f = 0; f + 4 < 12; f += 3) {
    const PairVote vote{{f, f + 4}, 60, 0};
    EXPECT_TRUE(mistaken(vote)) << f;
  }
  const HeldMatches held = held_matches(scene.graph, right, mistaken);
  EXPECT_EQ(held.contradicted, 0);
  EXPECT_EQ(held.mistaken, alone.contradicted);
  EXPECT_FALSE(held.contradict()) << held.share;
  HeldMatches hardly = held;
  hardly.share = 0.5;
  EXPECT_TRUE(hardly.contradict()) << "so many are false that the others may be as well";
  EXPECT_FALSE(question(std::nullopt)) << "no stations";
  EXPECT_FALSE(question(stations_within(8, all - 1))) << "a view without one";
  EXPECT_FALSE(question(stations_within(16, all))) << "a view beside its own";
}

TEST(MistakenPairs, TrueMatchesOfAModelThatIsOffByLessThanStationsTellStayWitnesses) {
  const FeatureScene scene = described_scene();
  PosedFrames off = true_poses(scene);
  for (std::size_t f = 0; f < off.poses.size(); ++f) {
    const double turn = f % 2 == 0 ? 0.2 : -0.2;  // 23 degrees between neighbours
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
    off.poses[f] = *off.poses[f] * Rigid3d{rotation, Eigen::Vector3d::Zero()};
  }
  const PairQuestion mistaken =
      mistaken_pairs(scene.graph, off, stations_within(12, static_cast<int>(scene.truth.size())),
                     scene.truth.size(), Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(mistaken);
  const HeldMatches held = held_matches(scene.graph, off, mistaken);
  EXPECT_EQ(held.mistaken, 0);
  EXPECT_TRUE(held.contradict());
}

/// Nothing holds elevations against the stations, so that a model which lays a loop upon another
/// agrees with them.
TEST(MistakenPairs, TurnsThatChangeElevationsAreNoneOfTheStations) {
  const FeatureScene scene = described_scene();
  PosedFrames tilted = true_poses(scene);
  const auto all = static_cast<int>(scene.truth.size());
  for (std::size_t f = 1; f < tilted.poses.size(); f += 2) {
    const Eigen::Vector3d center = camera_center(*tilted.poses[f]);
    const Eigen::Vector3d across = center.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(1.0, across));
    tilted.poses[f] = *tilted.poses[f] * Rigid3d{rotation, Eigen::Vector3d::Zero()};
  }
  const PairQuestion mistaken = mistaken_pairs(scene.graph, tilted, stations_within(5, all),
                                               scene.truth.size(), Eigen::Vector3d::UnitZ());
  const HeldMatches held = held_matches(scene.graph, tilted, mistaken);
  EXPECT_TRUE(held.contradict());
  EXPECT_GT(held.contradicted, held.mistaken);
}

}  // namespace
}  // namespace orbitfuse
