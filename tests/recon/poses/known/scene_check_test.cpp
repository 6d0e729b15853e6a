// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/scene_check.hpp"

#include <gmock/gmock.h>

#include "recon/poses/known/session_poses.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;

/// A box seen by a thermal camera from two loops, and its form as the visible field renders it.
class SceneCheck : public ::testing::Test {
 protected:
  SceneCheck() {
    const Camera lens = testing_orbit::camera(1000).scaled_to(320, 240);
    for (int i = 0; i < 16; ++i) {
      OrbitPose pose;
      pose.azimuth_deg = 45.0 * (i % 8) + 4.0 * ((i * 7) % 3 - 1);
      pose.elevation_deg = i < 8 ? 14 : 34;
      pose.radius = 2.5;
      views_.push_back({"view" + std::to_string(i), lens, cam_from_world_of(pose, lens)});
      orbit_.images.push_back(
          testing_orbit::box_view(lens, views_.back().cam_from_world, true).brightness);
    }
  }

  SceneJudgement judge(const std::vector<PosedView>& given) {
    const auto judged = judge_by_scene(testing_orbit::box_renderer(), orbit_, given, {});
    EXPECT_TRUE(judged) << judged.error().message();
    return judged.value_or(SceneJudgement{});
  }

  std::vector<PosedView> views_;
  OrbitViews orbit_;
};

TEST_F(SceneCheck, RightPosesPassWithoutAWord) {
  const SceneJudgement judged = judge(views_);
  EXPECT_EQ(judged.views, 16);
  EXPECT_EQ(judged.best_of_all, 16);
  EXPECT_LT(judged.median_apart_deg, 0.9);
  EXPECT_FALSE(judged.contradicted);
  EXPECT_TRUE(judged.wrong.empty() && judged.doubtful.empty());
}

TEST_F(SceneCheck, OneViewTurnedIsNamedAndNoOther) {
  std::vector<PosedView> given = views_;
  given[5].cam_from_world =
      Rigid3d{Eigen::Quaterniond(0, 0, 0, 1), Eigen::Vector3d::Zero()} * given[5].cam_from_world;
  const SceneJudgement judged = judge(given);
  EXPECT_FALSE(judged.contradicted);
  ASSERT_EQ(judged.wrong.size() + judged.doubtful.size(), 1u);
  EXPECT_EQ(judged.wrong.empty() ? judged.doubtful[0].first : judged.wrong[0].first, 5u);
}

TEST_F(SceneCheck, PosesOfTheNextImagesAreContradictedAndCalledThat) {
  std::vector<PosedView> given = views_;
  for (std::size_t v = 0; v < given.size(); ++v)
    given[v].cam_from_world = views_[(v + 1) % views_.size()].cam_from_world;
  const SceneJudgement judged = judge(given);
  EXPECT_TRUE(judged.contradicted);
  ASSERT_TRUE(judged.slip);
  EXPECT_EQ(judged.slip->words, "each pose is the next image's");
}

TEST_F(SceneCheck, AWorldThatIsTurnedOrOfOtherUnitsIsContradicted) {
  const auto in_world = [&](double turn_deg, double scale) {
    std::vector<PosedView> given = views_;
    const Similarity3d moved{
        scale,
        Eigen::Quaterniond(Eigen::AngleAxisd(turn_deg * EIGEN_PI / 180, Eigen::Vector3d::UnitZ())),
        Eigen::Vector3d::Zero()};
    for (PosedView& view : given) view.cam_from_world = rebase(view.cam_from_world, moved);
    return judge(given);
  };
  const SceneJudgement turned = in_world(8, 1);
  EXPECT_TRUE(turned.contradicted);
  EXPECT_GT(turned.median_apart_deg, 2);
  EXPECT_TRUE(in_world(0, 1.15).contradicted);
  EXPECT_TRUE(in_world(0, 1000).contradicted);
}

TEST_F(SceneCheck, FewViewsOrViewsThatLookTheSameWayAreNotJudged) {
  EXPECT_EQ(judge({views_.begin(), views_.begin() + 5}).views, 0);
  std::vector<PosedView> alike = views_;
  for (PosedView& view : alike) view.cam_from_world = views_.front().cam_from_world;
  EXPECT_EQ(judge(alike).views, 0);
}

TEST_F(SceneCheck, FlatImagesConfirmNoPose) {
  for (cv::Mat& image : orbit_.images) image = cv::Mat(image.size(), CV_32F, cv::Scalar(300));
  EXPECT_TRUE(judge(views_).contradicted);
}

TEST_F(SceneCheck, ARendererThatFailsIsPassedOn) {
  const SceneRenderer broken = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "cut", "train again");
  };
  const auto judged = judge_by_scene(broken, orbit_, views_, {});
  ASSERT_FALSE(judged);
  EXPECT_EQ(judged.error().where, "field");
}

TEST(WithoutKnownPoses, LeaveTheFocalLengthAsAUserWouldTellIt) {
  Session session;
  DeviceInfo device;
  device.id = "thermal0", device.modality = Modality::thermal;
  device.lens.calibrated = testing_orbit::camera(800);
  session.devices.push_back(device);
  FrameRecord frame;
  frame.modality = Modality::thermal, frame.device = "thermal0";
  frame.width = 640, frame.height = 480;
  frame.camera = device.lens.calibrated;
  frame.cam_from_world = Rigid3d{};
  session.frames.push_back(frame);
  const Session without = without_known_poses(session, Modality::thermal, 0.5);
  EXPECT_FALSE(has_known_poses(without, Modality::thermal));
  EXPECT_FALSE(without.devices[0].lens.calibrated);
  ASSERT_TRUE(without.devices[0].lens.focal_px);
  EXPECT_DOUBLE_EQ(*without.devices[0].lens.focal_px, 400);
  EXPECT_GT(without.devices[0].lens.focal_relative_sigma, 0);
  const Session other = without_known_poses(session, Modality::visible, 0.5);
  EXPECT_TRUE(other.devices[0].lens.calibrated) << "the other modality's stay";
  session.frames[0].camera->fx = 900;
  const Session separate = without_known_poses(session, Modality::thermal, 0.5);
  EXPECT_TRUE(separate.devices[0].lens.calibrated) << "it didn't come with the poses";
}

}  // namespace
}  // namespace orbitfuse
