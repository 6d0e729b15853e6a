// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/model_selection.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/support/orbit_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

/// 24 small photos of nothing that could be matched, at the stations of two loops.
Session orbit_session(const std::filesystem::path& folder) {
  Session session;
  session.folder = folder;
  DeviceInfo device;
  device.id = "visible0";
  session.devices.push_back(device);
  cv::RNG rng(7);
  for (int i = 0; i < 24; ++i) {
    FrameRecord frame;
    frame.device = "visible0";
    frame.file = "view" + std::to_string(i) + ".png";
    frame.width = 640, frame.height = 480;
    frame.station = Station{.index = i, .azimuth_deg = 30.0 * (i % 12), .elevation_deg = 0};
    frame.station->elevation_deg = i < 12 ? 14 : 34;
    cv::Mat image(480, 640, CV_8UC3, cv::Scalar(90, 90, 90));
    rng.fill(image(cv::Rect(300, 200, 60, 60)), cv::RNG::UNIFORM, 0, 255);
    cv::imwrite((folder / frame.file).string(), image);
    session.frames.push_back(frame);
  }
  return session;
}

class ModelSelectionTest : public ::testing::Test {
 protected:
  /// Whether a model of so many views is the answer where nothing better comes; `asked`: of views.
  bool stands(std::size_t count, bool stations = true, double asked = 0.8) {
    Session session = orbit_session(folder_.path());
    if (!stations)
      for (FrameRecord& frame : session.frames) frame.station.reset();
    const auto frames = session.frames_of(Modality::visible);
    PoseOptions options;
    options.min_posed_ratio = asked;
    options.max_image_side_px = 160;
    auto level = FeatureLevel::extract(session, frames, options, folder_ / "work", {});
    if (!level) {
      EXPECT_EQ(level.error().kind, ErrorKind::unavailable) << level.error().message();
      no_colmap_ = true;
      return false;
    }
    std::vector<PosedView> views = testing_orbit::two_loops();
    for (PosedView& view : views) view.name += ".png";
    views.resize(count);
    std::vector<LadderStep> steps;
    ModelSelection selection(session, frames, steps);
    EXPECT_FALSE(selection.consider("made", "", testing_orbit::seen_cube(views, 200, 0.2), *level));
    EXPECT_NE(selection.part(), nullptr) << steps.back().why;
    EXPECT_FALSE(selection.has_best());
    const bool taken = selection.take_part();
    EXPECT_EQ(selection.has_best(), taken);
    if (taken) {
      EXPECT_EQ(selection.settle().reconstruction.views.size(), count);
      EXPECT_TRUE(steps.front().held);
    }
    return taken;
  }

  test::TempFolder folder_;
  bool no_colmap_ = false;
};

TEST_F(ModelSelectionTest, APartStandsWhereStationsConfirmItAndNothingBetterComes) {
  const bool taken = stands(17);
  if (no_colmap_) GTEST_SKIP() << "no COLMAP on PATH";
  EXPECT_TRUE(taken);
}

TEST_F(ModelSelectionTest, APartIsNoAnswerWhereItIsSmallUnconfirmedOrMoreIsAskedFor) {
  const bool small = stands(16);
  if (no_colmap_) GTEST_SKIP() << "no COLMAP on PATH";
  EXPECT_FALSE(small);
  EXPECT_FALSE(stands(17, false));
  EXPECT_FALSE(stands(17, true, 0.9));
}

}  // namespace
}  // namespace orbitfuse
