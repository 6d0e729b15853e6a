// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/sfm/colmap.hpp"
#include "recon/poses/sfm/sfm_ladder.hpp"
#include "tests/support/orbit_scenes.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

TEST(ContainerSlow, VisibleOrbitToATenthOfAPercent) {
  const std::filesystem::path data = testing::shared_data();
  if (!std::filesystem::exists(data)) GTEST_SKIP() << data << " is not here: set ORBITFUSE_SHARED";
  const test::TempFolder folder;
  const auto scene = scenes::container_scene(data, {});
  const auto poses = estimate_visible_poses(scene.session, {}, folder.path(), {});
  if (!poses && poses.error().kind == ErrorKind::unavailable) GTEST_SKIP() << "no COLMAP on PATH";
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_EQ(poses->reconstruction.views.size(), 24u);
  const auto error = scenes::pose_error(poses->reconstruction, poses->reconstruction, scene.truth);
  EXPECT_LE(error.ate_percent, 0.1);
}

/// COLMAP poses 19 of 24 views there, too few to stand; the others find their places on its points.
TEST(SedanSlow, PartOfAModelIsCompleted) {
  const std::filesystem::path data = testing::shared_data();
  if (!std::filesystem::exists(data)) GTEST_SKIP() << data << " is not here: set ORBITFUSE_SHARED";
  const test::TempFolder folder;
  scenes::ContainerOptions sedan;
  sedan.scene = "sedan";
  const auto scene = scenes::container_scene(data, sedan);
  const auto poses = estimate_visible_poses(scene.session, {}, folder.path(), {});
  if (!poses && poses.error().kind == ErrorKind::unavailable) GTEST_SKIP() << "no COLMAP on PATH";
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_EQ(poses->reconstruction.views.size(), 24u);
  EXPECT_LE(
      scenes::pose_error(poses->reconstruction, poses->reconstruction, scene.truth).ate_percent,
      0.1);
  for (const LadderStep& step : poses->ladder)
    EXPECT_EQ(step.attempt.find("faint"), std::string::npos) << step.attempt;
}

/// The tracking frames alone, with the focal length known: what the measured wrong model was made
/// from.
scenes::Scene tracking_scene(const std::filesystem::path& data) {
  scenes::ContainerOptions container;
  container.tracking = true;
  scenes::Scene scene = scenes::container_scene(data, container);
  std::erase_if(scene.session.frames, [](const FrameRecord& frame) { return !frame.tracking; });
  for (DeviceInfo& device : scene.session.devices) device.lens.focal_relative_sigma = 0;
  return scene;
}

/// Local contrast, a low peak threshold, every pair and the most relaxed mapper. Pairs of
/// neighbours alone (three to each side, one across the loops) give a right model of 29 frames:
/// what merges front and back are the matches between them.
Result<Reconstruction> colmap_model(const Session& session,
                                    const std::vector<const FrameRecord*>& frames,
                                    const std::filesystem::path& folder) {
  ProxyOptions proxies;
  proxies.clahe = proxies.destripe = true;
  ColmapOptions engine;
  engine.peak_threshold /= 3;
  ORBITFUSE_ASSIGN(const std::vector<ProxyImage> images,
                   write_proxies(session, frames, proxies, folder / "images", {}));
  ORBITFUSE_ASSIGN(ColmapProject project,
                   ColmapProject::create(folder / "colmap", folder / "images", engine));
  ORBITFUSE_TRY(project.extract(session, images, {}));
  ORBITFUSE_TRY(project.match(images, exhaustive_pairs(static_cast<int>(frames.size())), {}));
  return project.map(session, images, mapper_ladder().back(), {});
}

TEST(ContainerSlow, MergedThermalTrackingModelIsNotBelieved) {
  const std::filesystem::path data = testing::shared_data();
  if (!std::filesystem::exists(data)) GTEST_SKIP() << data << " is not here: set ORBITFUSE_SHARED";
  const test::TempFolder folder;
  const scenes::Scene scene = tracking_scene(data);
  const auto frames = scene.session.frames_of(Modality::thermal, true);
  const auto model = colmap_model(scene.session, frames, folder.path());
  if (!model && model.error().kind == ErrorKind::unavailable) GTEST_SKIP() << "no COLMAP on PATH";
  ASSERT_TRUE(model) << model.error().message();
  fmt::print("COLMAP: {} of {} frames, {} points\n", model->views.size(), frames.size(),
             model->points.size());
  ASSERT_GE(model->views.size(), frames.size() / 2) << "no model to be mistaken about";

  // Also where every model is complete enough: its shape alone must give it away.
  for (const double min_posed_ratio : {PoseOptions{}.min_posed_ratio, 0.0}) {
    PoseOptions options;
    options.min_posed_ratio = min_posed_ratio;
    const auto judged = judge_model(*model, scene.session, frames, options);
    ASSERT_TRUE(judged) << judged.error().message();
    const Reconstruction& adjusted = judged->poses.reconstruction;
    const PoseError error = scenes::pose_error(adjusted, adjusted, scene.truth);
    fmt::print("{:.2f} px; centres {:.0f} % of the extent and {:.0f} deg off; gates: {}\n",
               judged->poses.gates.at("reprojection_rms_proxy_px"), error.ate_percent,
               error.rotation_mean_deg, judged->why);
    ASSERT_GT(error.ate_percent, 10) << "a right model proves nothing here";
    EXPECT_LT(judged->poses.gates.at("reprojection_rms_proxy_px"), options.max_reprojection_rms_px)
        << "wrong, and not to be told by its residuals";
    EXPECT_FALSE(judged->believed) << judged->why;
  }
}

}  // namespace
}  // namespace orbitfuse
