// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/photo_check.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <numeric>

#include "recon/poses/index.hpp"
#include "recon/poses/known/line_misses.hpp"
#include "tests/recon/poses/feature_scene.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;
using testing_orbit::FeatureScene;

Reconstruction given(const FeatureScene& scene) {
  Reconstruction model;
  model.views = scene.truth;
  return model;
}

/// Each photo with the pose of the one that `from` names.
template <class Function>
Reconstruction reordered(const FeatureScene& scene, const Function& from) {
  Reconstruction model = given(scene);
  for (std::size_t v = 0; v < model.views.size(); ++v)
    model.views[v].cam_from_world = scene.truth[from(v) % model.views.size()].cam_from_world;
  return model;
}

PhotoJudgement judge(const FeatureScene& scene, const Reconstruction& model) {
  const auto judged = judge_by_photos(scene.graph, model, {});
  EXPECT_TRUE(judged);
  return judged.value_or(PhotoJudgement{});
}

void turn(PosedView& view, double angle_deg, const Eigen::Vector3d& axis) {
  view.cam_from_world =
      Rigid3d{Eigen::Quaterniond(Eigen::AngleAxisd(angle_deg * EIGEN_PI / 180, axis.normalized())),
              Eigen::Vector3d::Zero()} *
      view.cam_from_world;
}

std::vector<std::size_t> indices_of(const NamedViews& named) {
  std::vector<std::size_t> frames;
  for (const auto& [frame, why] : named) frames.push_back(frame);
  std::sort(frames.begin(), frames.end());
  return frames;
}

TEST(PhotoCheck, RightPosesPassWithoutAWord) {
  const FeatureScene scene = testing_orbit::described_scene();
  const PhotoJudgement judged = judge(scene, given(scene));
  EXPECT_EQ(judged.checked, 24);
  EXPECT_GT(judged.share, 0.95);
  EXPECT_LT(judged.median_px, 1);
  EXPECT_FALSE(judged.contradicted);
  EXPECT_FALSE(judged.slip);
  EXPECT_TRUE(judged.wrong.empty() && judged.doubtful.empty());
}

TEST(PhotoCheck, OneViewTurnedOrTwoExchangedAreNamedAndNoOther) {
  const FeatureScene scene = testing_orbit::described_scene();
  Reconstruction turned = given(scene);
  turn(turned.views[7], 180, {0, 0, 1});
  PhotoJudgement judged = judge(scene, turned);
  EXPECT_FALSE(judged.contradicted);
  EXPECT_EQ(indices_of(judged.wrong), std::vector<std::size_t>{7});
  EXPECT_TRUE(judged.doubtful.empty());
  ASSERT_FALSE(judged.wrong.empty());
  EXPECT_THAT(judged.wrong.front().second, HasSubstr("its known pose gives: correct it"));

  Reconstruction exchanged = given(scene);
  std::swap(exchanged.views[3].cam_from_world, exchanged.views[9].cam_from_world);
  judged = judge(scene, exchanged);
  EXPECT_FALSE(judged.contradicted);
  EXPECT_EQ(indices_of(judged.wrong), (std::vector<std::size_t>{3, 9}));
}

TEST(PhotoCheck, AMistakeOfAllPosesIsCalledByItsName) {
  const FeatureScene scene = testing_orbit::described_scene();
  const auto slip_of = [&](const Reconstruction& spoilt) {
    const PhotoJudgement judged = judge(scene, spoilt);
    EXPECT_TRUE(judged.contradicted);
    return judged.slip ? judged.slip->words : "none";
  };
  const Reconstruction shifted = reordered(scene, [](std::size_t v) { return v + 1; });
  EXPECT_EQ(slip_of(shifted), "each pose is the next image's");
  Reconstruction inverted = given(scene);
  for (PosedView& view : inverted.views) view.cam_from_world = view.cam_from_world.inverse();
  EXPECT_THAT(slip_of(inverted), HasSubstr("inverted"));
  Reconstruction flipped = given(scene);
  for (PosedView& view : flipped.views) turn(view, 180, {1, 0, 0});
  EXPECT_THAT(slip_of(flipped), HasSubstr("y and z axes are turned"));
  Reconstruction longer = given(scene);
  for (PosedView& view : longer.views) view.camera.fx *= 1.3, view.camera.fy *= 1.3;
  const PhotoJudgement judged = judge(scene, longer);
  ASSERT_TRUE(judged.slip);
  EXPECT_THAT(judged.slip->words, HasSubstr("focal length"));
  EXPECT_NEAR(judged.slip->true_focal, 1 / 1.3, 0.02);
}

TEST(PhotoCheck, PosesInAnOrderOfTheirOwnAreContradictedThoughNoUsualMistakeExplainsThem) {
  const FeatureScene scene = testing_orbit::described_scene();
  std::vector<std::size_t> random(24);
  std::iota(random.begin(), random.end(), std::size_t{0});
  std::mt19937 rng(4);
  std::shuffle(random.begin(), random.end(), rng);
  for (const Reconstruction& spoilt : {reordered(scene, [&](std::size_t v) { return random[v]; }),
                                       reordered(scene, [](std::size_t v) { return v * 5 + 1; })}) {
    const PhotoJudgement judged = judge(scene, spoilt);
    EXPECT_TRUE(judged.contradicted);
    EXPECT_FALSE(judged.slip);
  }
}

TEST(PhotoCheck, TwoReconstructionsInOneFileAreToldApart) {
  const FeatureScene scene = testing_orbit::described_scene();
  for (const auto& [turn_deg, scale] : {std::pair(20.0, 1.0), {0.0, 1.3}}) {
    const Similarity3d aside{
        scale,
        Eigen::Quaterniond(Eigen::AngleAxisd(turn_deg * EIGEN_PI / 180, Eigen::Vector3d::UnitZ())),
        Eigen::Vector3d::Zero()};
    Reconstruction two = given(scene);
    std::vector<int> first(12), second(12);
    std::iota(first.begin(), first.end(), 0);
    std::iota(second.begin(), second.end(), 12);
    for (const int v : second)
      two.views[at(v)].cam_from_world = rebase(two.views[at(v)].cam_from_world, aside);
    const PhotoJudgement judged = judge(scene, two);
    EXPECT_TRUE(judged.contradicted) << turn_deg;
    ASSERT_TRUE(judged.blocks) << turn_deg;
    EXPECT_EQ(judged.blocks->frames, (std::vector<std::vector<int>>{first, second}));
  }
  // A single view aside is no block.
  Reconstruction one = given(scene);
  turn(one.views[4], 10, {0, 1, 0});
  EXPECT_FALSE(judge(scene, one).blocks);
}

TEST(PhotoCheck, PosesThatAreAllALittleOffAreImpreciseAndNoneIsNamed) {
  const FeatureScene scene = testing_orbit::described_scene();
  Reconstruction off = given(scene);
  std::mt19937 rng(2);
  std::normal_distribution<double> normal(0, 0.5);
  for (PosedView& view : off.views) {
    turn(view, normal(rng), {1, 0, 0});
    turn(view, normal(rng), {0, 1, 0});
  }
  const PhotoJudgement judged = judge(scene, off);
  EXPECT_FALSE(judged.contradicted);
  EXPECT_GT(judged.median_px, 1.5);
  EXPECT_TRUE(judged.wrong.empty());
  EXPECT_LE(judged.doubtful.size(), 2u) << "but for what is far more off than the others";
}

TEST(PhotoCheck, WithoutMatchesNothingIsJudged) {
  FeatureScene scene = testing_orbit::described_scene();
  scene.graph.verified.clear();
  Reconstruction inverted = given(scene);
  for (PosedView& view : inverted.views) view.cam_from_world = view.cam_from_world.inverse();
  const PhotoJudgement judged = judge(scene, inverted);
  EXPECT_EQ(judged.checked, 0);
  EXPECT_FALSE(judged.contradicted);
  EXPECT_TRUE(judged.wrong.empty());
}

TEST(PhotoCheck, EachPhotoIsJudgedWithTheLensThatItsPoseCameWith) {
  // Half of the photos of one device and size are taken with a lens 1.4 times as long.
  FeatureScene scene = testing_orbit::described_scene();
  Reconstruction two_lenses = given(scene);
  for (std::size_t v = 0; v < two_lenses.views.size(); v += 2) {
    Camera& camera = two_lenses.views[v].camera;
    camera.fx *= 1.4, camera.fy *= 1.4;
    Eigen::Matrix2Xd& pixels = scene.graph.pixels[v];
    const Eigen::Vector2d center(camera.cx, camera.cy);
    pixels = ((pixels.colwise() - center) * 1.4).colwise() + center;
  }
  const PhotoJudgement judged = judge(scene, two_lenses);
  EXPECT_FALSE(judged.contradicted);
  EXPECT_GT(judged.share, 0.95);
  EXPECT_TRUE(judged.wrong.empty() && judged.doubtful.empty());
}

TEST(PhotoCheck, StopsWhenAsked) {
  const FeatureScene scene = testing_orbit::described_scene();
  const std::atomic<bool> stop = true;
  Progress stopping;
  stopping.cancel = &stop;
  const auto stopped = judge_by_photos(scene.graph, given(scene), stopping);
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
}

TEST(LineMisses, TwoCamerasAtOnePlaceHaveNoLines) {
  const FeatureScene scene = testing_orbit::described_scene();
  Reconstruction at_one_place = given(scene);
  for (PosedView& view : at_one_place.views)
    view.cam_from_world = at_one_place.views.front().cam_from_world;
  EXPECT_TRUE(
      line_misses(scene.graph, scene.graph.verified, posed_frames(scene.graph, at_one_place))
          .empty());
  EXPECT_EQ(judge(scene, at_one_place).checked, 0);
}

}  // namespace
}  // namespace orbitfuse
