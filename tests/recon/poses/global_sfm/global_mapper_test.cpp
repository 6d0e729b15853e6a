// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/global_sfm/global_mapper.hpp"

#include <gtest/gtest.h>

#include "recon/poses/sfm/bundle_adjustment.hpp"
#include "tests/recon/poses/feature_scene.hpp"

namespace orbitfuse {
namespace {

using testing_orbit::FeatureScene;
using testing_orbit::FeatureSceneMaker;
using testing_orbit::worst_center;

Result<Reconstruction> adjust(Reconstruction model) {
  const std::vector<int> group(model.views.size(), 0);
  LensGroup lens;
  lens.focal_px = 600;
  lens.refine_principal_point = lens.refine_distortion = false;
  ORBITFUSE_TRY(adjust_bundle(model, group, {lens}, {}));
  return model;
}

double direction_error_deg(const RelativePose& pose, const std::vector<PosedView>& truth) {
  const Rigid3d relative = truth[static_cast<std::size_t>(pose.second)].cam_from_world *
                           truth[static_cast<std::size_t>(pose.first)].cam_from_world.inverse();
  const double cosine = relative.translation.normalized().dot(pose.second_from_first.translation);
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / EIGEN_PI;
}

TEST(GlobalMapper, AMachineAmongRepeatedPillarsIsPosed) {
  FeatureScene scene = FeatureSceneMaker({}).make();
  int misled = 0;
  for (const auto& [pair, matches] : scene.graph.proposed) {
    const auto poses = relative_poses(scene.graph, pair, {});
    if (!poses.empty()) misled += direction_error_deg(poses.front(), scene.truth) > 10 ? 1 : 0;
  }
  EXPECT_GE(misled, 10) << "without pairs that the pillars mislead this proves nothing";

  const auto global = map_globally(scene.graph, adjust, {}, {});
  ASSERT_TRUE(global) << global.error().message();
  EXPECT_EQ(global->model.views.size(), 24u) << global->found;
  EXPECT_LT(worst_center(global->model, scene.truth), 0.01) << global->found;
}

TEST(GlobalMapper, AnOperatorWhoWalksTheOtherWayIsUnderstood) {
  FeatureScene scene = FeatureSceneMaker({}).make();
  for (FrameRecord& frame : scene.session.frames) frame.station->azimuth_deg *= -1;
  const auto global = map_globally(scene.graph, adjust, {}, {});
  ASSERT_TRUE(global) << global.error().message();
  EXPECT_EQ(global->model.views.size(), 24u) << global->found;
  EXPECT_LT(worst_center(global->model, scene.truth), 0.01) << global->found;
}

TEST(GlobalMapper, WithoutStationsTheStrongestPairsBegin) {
  testing_orbit::FeatureSceneOptions plain;
  plain.wrong_pillar = 0;
  FeatureScene scene = FeatureSceneMaker(plain).make();
  for (FrameRecord& frame : scene.session.frames) frame.station.reset();
  const auto global = map_globally(scene.graph, adjust, {}, {});
  ASSERT_TRUE(global) << global.error().message();
  EXPECT_EQ(global->model.views.size(), 24u) << global->found;
  EXPECT_LT(worst_center(global->model, scene.truth), 0.01) << global->found;
}

TEST(GlobalMapper, ViewsThatShareNothingGetNoCommonModel) {
  FeatureScene scene = FeatureSceneMaker({}).make();
  std::erase_if(scene.graph.proposed, [](const auto& entry) {
    return (entry.first.first < 12) != (entry.first.second < 12);  // no pair across the loops
  });
  const auto global = map_globally(scene.graph, adjust, {}, {});
  ASSERT_TRUE(global) << global.error().message();
  EXPECT_LE(global->model.views.size(), 12u) << "two loops without a common scale";
}

TEST(RotationAveraging, PairsThatTheLoopContradictsAreThrownOut) {
  const std::vector<PosedView> truth = testing_orbit::two_loops();
  PairCandidates candidates;
  const auto add = [&](int i, int j, double wrong_deg) {
    RelativePose pose;
    pose.first = i, pose.second = j;
    pose.second_from_first = truth[static_cast<std::size_t>(j)].cam_from_world *
                             truth[static_cast<std::size_t>(i)].cam_from_world.inverse();
    pose.second_from_first.rotation =
        Eigen::AngleAxisd(wrong_deg * EIGEN_PI / 180, Eigen::Vector3d(1, 2, 1).normalized()) *
        pose.second_from_first.rotation;
    candidates.push_back({pose});
  };
  for (int i = 0; i < 12; ++i) {
    add(i, (i + 1) % 12, i % 5 == 2 ? 40 : 0);
    add(i, (i + 2) % 12, i % 5 == 4 ? -35 : 0);
    add(12 + i, 12 + (i + 1) % 12, 0);
    add(i, 12 + i, 0);
  }
  const auto averaged = average_rotations(
      candidates, std::vector<std::optional<Eigen::Quaterniond>>(24), RotationOptions{});
  EXPECT_EQ(averaged.kept.size(), 48u - 4u);
  const Eigen::Quaterniond world =
      averaged.cam_from_world[0].conjugate() * truth[0].cam_from_world.rotation;
  for (std::size_t v = 0; v < 24; ++v)
    EXPECT_LT(averaged.cam_from_world[v].angularDistance(truth[v].cam_from_world.rotation *
                                                         world.conjugate()),
              0.02)
        << v;
}

}  // namespace
}  // namespace orbitfuse
