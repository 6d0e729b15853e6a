// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <tuple>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

/// `count` textured visible images on disk and their session.
Session session_of(const std::filesystem::path& folder, int count) {
  Session session;
  session.folder = folder;
  DeviceInfo device;
  device.id = "visible0";
  session.devices.push_back(device);
  std::filesystem::create_directories(folder / "visible");
  cv::RNG rng(7);
  for (int i = 0; i < count; ++i) {
    cv::Mat image(120, 160, CV_8UC3);
    rng.fill(image, cv::RNG::UNIFORM, 0, 255);
    FrameRecord frame;
    frame.device = "visible0";
    frame.file = "visible/" + std::to_string(i) + ".png";
    frame.width = 160, frame.height = 120;
    cv::imwrite((folder / frame.file).string(), image);
    session.frames.push_back(frame);
  }
  return session;
}

TEST(EstimatePoses, NoColmapIsUnavailableAndNamesTheRemedy) {
  const test::TempFolder folder;
  PoseOptions options;
  options.colmap = "no-colmap-on-this-path";
  const auto poses =
      estimate_visible_poses(session_of(folder.path(), 4), options, folder / "work", {});
  ASSERT_FALSE(poses);
  EXPECT_EQ(poses.error().kind, ErrorKind::unavailable);
  EXPECT_NE(poses.error().remedy.find("install"), std::string::npos) << poses.error().message();
}

TEST(EstimatePoses, OneImageIsAnInputError) {
  const test::TempFolder folder;
  const auto poses = estimate_visible_poses(session_of(folder.path(), 1), {}, folder / "work", {});
  ASSERT_FALSE(poses);
  EXPECT_EQ(poses.error().kind, ErrorKind::input);
  EXPECT_NE(poses.error().found.find("1 visible"), std::string::npos);
}

TEST(EstimatePoses, AnUnreadableImageIsNamed) {
  const test::TempFolder folder;
  const Session session = session_of(folder.path(), 3);
  test::put(folder / "visible/1.png", "this is a text file");
  const auto poses = estimate_visible_poses(session, {}, folder / "work", {});
  ASSERT_FALSE(poses);
  EXPECT_EQ(poses.error().kind, ErrorKind::input);
  EXPECT_NE(poses.error().message().find("visible/1.png"), std::string::npos)
      << poses.error().message();
}

TEST(EstimatePoses, CancelledStops) {
  const test::TempFolder folder;
  const std::atomic<bool> stop = true;
  Progress progress;
  progress.cancel = &stop;
  const auto poses =
      estimate_visible_poses(session_of(folder.path(), 3), {}, folder / "work", progress);
  ASSERT_FALSE(poses);
  EXPECT_EQ(poses.error().kind, ErrorKind::cancelled);
}

TEST(EstimatePoses, AViewWithoutFeaturesIsNamedAndNeverMatched) {
  const test::TempFolder folder;
  const Session session = session_of(folder.path(), 4);
  cv::imwrite((folder / "visible/2.png").string(), cv::Mat(120, 160, CV_8UC3, cv::Scalar(9, 9, 9)));
  const auto poses = estimate_visible_poses(session, {}, folder / "work", {});
  ASSERT_FALSE(poses) << "noise has no pose";
  if (poses.error().kind == ErrorKind::unavailable) GTEST_SKIP() << "no COLMAP on PATH";
  EXPECT_EQ(poses.error().kind, ErrorKind::quality) << poses.error().message();
  EXPECT_NE(poses.error().found.find("visible/2.png shows nothing to match"), std::string::npos)
      << poses.error().message();
  const bool has_stations = session.frames.front().station.has_value();
  EXPECT_NE(poses.error().remedy.find("--station-spacing-deg") != std::string::npos, has_stations)
      << poses.error().remedy;
}

TEST(EstimatePoses, OptionsOutOfRangeAreNamed) {
  PoseOptions options;
  options.min_posed_ratio = std::nan("");
  ASSERT_FALSE(options.validate());
  EXPECT_EQ(options.validate().error().where, "poses.min_posed_ratio");
  EXPECT_TRUE(PoseOptions{}.validate());
}

TEST(EstimatePoses, KnownPosesReplaceTheStage) {
  const test::TempFolder folder;
  Session session = session_of(folder.path(), 3);
  for (std::size_t i = 0; i < 3; ++i) {
    Camera camera = Camera::from_fov(160, 120, 60);
    session.frames[i].camera = camera;
    Rigid3d pose;
    pose.translation.x() = static_cast<double>(i);
    session.frames[i].cam_from_world = pose;
  }
  PoseOptions options;
  options.colmap = "no-colmap-on-this-path";
  const auto poses = estimate_visible_poses(session, options, folder / "work", {});
  ASSERT_TRUE(poses) << poses.error().message();
  ASSERT_EQ(poses->reconstruction.views.size(), 3u);
  EXPECT_EQ(poses->reconstruction.views[2].cam_from_world.translation.x(), 2.0);
}

TEST(EstimatePoses, AKnownPoseWhereNoOrbitReachesIsDroppedByName) {
  const test::TempFolder folder;
  PoseOptions options;
  options.colmap = "no-colmap-on-this-path";
  for (const auto& [count, far, kept] :
       {std::tuple(5, 1e12, 4), {5, 200.0, 5}, {3, 1e12, 3}, {5, 1e200, 4}}) {
    Session session = session_of(folder.path(), count);
    for (int i = 0; i < count; ++i) {
      Rigid3d pose;
      pose.translation = {std::cos(i), std::sin(i), 0};
      if (i == 1) pose.translation.z() = far;
      session.frames[static_cast<std::size_t>(i)].camera = Camera::from_fov(160, 120, 60);
      session.frames[static_cast<std::size_t>(i)].cam_from_world = pose;
    }
    const auto poses = estimate_visible_poses(session, options, folder / "work", {});
    ASSERT_TRUE(poses) << poses.error().message();
    EXPECT_EQ(static_cast<int>(poses->reconstruction.views.size()), kept) << count << " " << far;
    ASSERT_EQ(static_cast<int>(poses->dropped.size()), count - kept);
    for (const DroppedView& view : poses->dropped) EXPECT_EQ(view.name, session.frames[1].file);
  }
}

TEST(EstimatePoses, KnownPosesAtOnePlaceAreRefusedHoweverTheyAreRounded) {
  const test::TempFolder folder;
  PoseOptions options;
  options.colmap = "no-colmap-on-this-path";
  for (const double offset : {0.0, 4e8}) {
    for (const double apart : {0.0, 1e-16, 0.4}) {
      Session session = session_of(folder.path(), 3);
      for (std::size_t i = 0; i < 3; ++i) {
        session.frames[i].camera = Camera::from_fov(160, 120, 60);
        Rigid3d pose;
        pose.translation.x() = offset + apart * static_cast<double>(i);
        session.frames[i].cam_from_world = pose;
      }
      const auto poses = estimate_visible_poses(session, options, folder / "work", {});
      EXPECT_EQ(poses.has_value(), apart > 0.1) << offset << " " << apart;
      if (!poses) {
        EXPECT_NE(poses.error().message().find("one place"), std::string::npos);
      }
    }
  }
}

}  // namespace
}  // namespace orbitfuse
