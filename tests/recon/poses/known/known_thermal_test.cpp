// SPDX-License-Identifier: BSD-3-Clause
// Known thermal poses on their way through the pose stage: believed, replaced or all in doubt.
#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "core/image/image_io.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using ::testing::HasSubstr;

/// A box from twelve places by each camera, all with known poses; no COLMAP.
class KnownThermal : public ::testing::Test {
 protected:
  KnownThermal() {
    session_.folder = folder_.path();
    scene_.renderer = testing_orbit::box_renderer();
    options_.colmap = "no-colmap-on-this-path";
    for (const Modality modality : {Modality::visible, Modality::thermal}) {
      DeviceInfo device;
      device.id = std::string(name(modality)) + "0", device.modality = modality;
      session_.devices.push_back(device);
      std::filesystem::create_directories(folder_ / std::string(name(modality)));
      for (int i = 0; i < 12; ++i) add_frame(modality, i);
    }
  }

  void add_frame(Modality modality, int i) {
    const bool thermal = modality == Modality::thermal;
    const Camera lens = testing_orbit::camera(1000).scaled_to(320, 240);
    OrbitPose pose;
    pose.azimuth_deg = 30.0 * i + (thermal ? 8 : 0) + 3.0 * (i % 3);
    pose.elevation_deg = i % 2 == 0 ? 14 : 24;
    pose.radius = 2.5;
    FrameRecord frame;
    frame.modality = modality, frame.device = std::string(name(modality)) + "0";
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.file = fmt_name(modality, i);
    frame.width = 320, frame.height = 240;
    frame.camera = lens;
    frame.cam_from_world = cam_from_world_of(pose, lens);
    const cv::Mat values = testing_orbit::box_view(lens, *frame.cam_from_world, thermal).brightness;
    if (thermal) {
      EXPECT_TRUE(write_thermal_tiff(folder_ / frame.file, 290 + 20 * values));
    } else {
      cv::Mat gray;
      values.convertTo(gray, CV_8U, 255);
      cv::imwrite((folder_ / frame.file).string(), gray);
      scene_.reconstruction.views.push_back({frame.file, lens, *frame.cam_from_world});
    }
    session_.frames.push_back(frame);
  }

  static std::string fmt_name(Modality modality, int i) {
    return std::string(name(modality)) + "/" + std::to_string(100 + i) +
           (modality == Modality::thermal ? ".tiff" : ".png");
  }

  Result<ThermalPoses> estimate() {
    return estimate_thermal_poses(session_, &scene_, options_, folder_ / "work", {});
  }

  test::TempFolder folder_;
  Session session_;
  VisibleScene scene_;
  PoseOptions options_;
};

TEST_F(KnownThermal, RightOnesAreKeptWithoutAWord) {
  const auto poses = estimate();
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_TRUE(poses->shares_visible_frame);
  EXPECT_EQ(poses->reconstruction.views.size(), 12u);
  EXPECT_TRUE(poses->doubtful.empty() && poses->dropped.empty() && poses->warnings.empty());
  EXPECT_EQ(poses->gates.at("known_poses_best_of_all"), 12);
}

TEST_F(KnownThermal, OnesThatNothingConfirmsOrReplacesAreAllInDoubtUnlessTakenAsTheyAre) {
  session_.frames.resize(19);  // seven thermal ones are too few to be placed by their order alone
  for (std::size_t i = 12; i < 19; ++i)
    ASSERT_TRUE(write_thermal_tiff(folder_ / session_.frames[i].file,
                                   cv::Mat(240, 320, CV_32F, cv::Scalar(300))));
  auto poses = estimate();
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_TRUE(poses->shares_visible_frame);
  EXPECT_EQ(poses->reconstruction.views.size(), 7u);
  EXPECT_EQ(poses->doubtful.size(), 7u);
  ASSERT_EQ(poses->warnings.size(), 1u);
  EXPECT_THAT(poses->warnings.front(),
              ::testing::AllOf(HasSubstr("doesn't confirm the known thermal poses, and the images "
                                         "alone place no views ("),
                               HasSubstr("): they are all in doubt")));
  options_.check_known_poses = false;
  poses = estimate();
  ASSERT_TRUE(poses);
  EXPECT_TRUE(poses->warnings.empty() && poses->doubtful.empty());
}

TEST_F(KnownThermal, OneOfAnotherImageIsNamed) {
  std::swap(session_.frames[14].cam_from_world, session_.frames[19].cam_from_world);
  const auto poses = estimate();
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_EQ(poses->dropped.size() + poses->doubtful.size(), 2u);
  for (const DroppedView& view : poses->dropped)
    EXPECT_TRUE(view.name == session_.frames[14].file || view.name == session_.frames[19].file);
  for (const DoubtfulView& view : poses->doubtful)
    EXPECT_TRUE(view.name == session_.frames[14].file || view.name == session_.frames[19].file);
  EXPECT_EQ(poses->ladder.back().posed, static_cast<int>(poses->reconstruction.views.size()));
}

TEST_F(KnownThermal, WithoutPosesStationsThatThePhotosContradictGetThePhotosSpacing) {
  for (FrameRecord& frame : session_.frames) {
    Station& station = frame.station.emplace();
    station.index = static_cast<int>(frame.sequence);
    station.azimuth_deg = 15.0 * station.index;  // of 30
    station.azimuth_sigma_deg.reset(), station.elevation_sigma_deg.reset();
  }
  const auto truth = session_.frames;
  for (FrameRecord& frame : session_.frames)
    if (frame.modality == Modality::thermal) frame.cam_from_world.reset();
  const auto poses = estimate();
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_THAT(poses->warnings, ::testing::Contains(HasSubstr("the photos' own spacing, 30")));
  EXPECT_GE(poses->reconstruction.views.size(), 10u);
  for (const PosedView& view : poses->reconstruction.views) {
    const auto frame = std::find_if(truth.begin(), truth.end(),
                                    [&](const FrameRecord& f) { return f.file == view.name; });
    EXPECT_LT((camera_center(view.cam_from_world) - camera_center(*frame->cam_from_world)).norm(),
              0.15)
        << view.name;
  }
}

TEST_F(KnownThermal, ADeclaredRigWithoutPairsIsPosedApartWithAWord) {
  session_.notes["rig"] = "yes";
  for (FrameRecord& frame : session_.frames) {
    if (frame.modality != Modality::thermal) continue;
    frame.cam_from_world.reset();
    const std::string stored = frame.file;  // a name without a number, which no photo has
    frame.file = "thermal/" + std::string(frame.sequence + 1, 'x') + ".tiff";
    std::filesystem::rename(folder_ / stored, folder_ / frame.file);
  }
  const auto poses = estimate();
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_THAT(poses->warnings, ::testing::Contains(HasSubstr("are one rig, but neither names")));
  EXPECT_FALSE(poses->ladder.front().held);
}

TEST_F(KnownThermal, OfAWorldWithoutPhotosTheyAreTakenAndToldUnchecked) {
  for (std::size_t i = 0; i < 12; ++i) session_.frames[i].cam_from_world.reset();
  const auto poses = estimate();
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_FALSE(poses->shares_visible_frame);
  EXPECT_EQ(poses->reconstruction.views.size(), 12u);
  ASSERT_EQ(poses->warnings.size(), 1u);
  EXPECT_THAT(poses->warnings[0], HasSubstr("nothing checks the known thermal poses"));
  for (std::size_t i = 14; i < 24; ++i) session_.frames[i].cam_from_world.reset();
  const auto few = estimate();
  ASSERT_TRUE(few) << few.error().message();
  EXPECT_THAT(few->warnings.front(), HasSubstr("2 of 12 thermal frames have a known pose"));
}

TEST_F(KnownThermal, RendersAreAskedForWhereTheyCanSayAnything) {
  EXPECT_TRUE(asks_for_renders(session_, options_));
  options_.check_known_poses = false;
  EXPECT_FALSE(asks_for_renders(session_, options_));
  options_.use_known_poses = false;
  EXPECT_TRUE(asks_for_renders(session_, options_)) << "to place the views";
  options_ = {};
  for (std::size_t i = 17; i < 24; ++i) session_.frames[i].cam_from_world.reset();
  EXPECT_FALSE(asks_for_renders(session_, options_)) << "five are too few to judge";
  for (std::size_t i = 0; i < 12; ++i) session_.frames[i].cam_from_world.reset();
  EXPECT_FALSE(asks_for_renders(session_, options_)) << "in a world of their own";
  for (std::size_t i = 12; i < 24; ++i) session_.frames[i].cam_from_world.reset();
  EXPECT_TRUE(asks_for_renders(session_, options_));
}

}  // namespace
}  // namespace orbitfuse
