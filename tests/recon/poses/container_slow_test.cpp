// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "bench/poses/scenes.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "tests/core/temp_folder.hpp"

namespace orbitfuse {
namespace {

TEST(ContainerSlow, VisibleOrbitToATenthOfAPercent) {
  const auto data = bench::shared_data();
  if (!data) GTEST_SKIP() << "shared data absent: set ORBITFUSE_SHARED";
  const test::TempFolder folder;
  const auto scene = bench::container_scene(*data, {});
  const auto poses = estimate_visible_poses(scene.session, {}, folder.path(), {});
  if (!poses && poses.error().kind == ErrorKind::unavailable) GTEST_SKIP() << "no COLMAP on PATH";
  ASSERT_TRUE(poses) << poses.error().message();
  EXPECT_EQ(poses->reconstruction.views.size(), 24u);
  const auto error = bench::pose_error(poses->reconstruction, poses->reconstruction, scene.truth);
  EXPECT_LE(error.ate_percent, 0.1);
}

TEST(ContainerSlow, MergedThermalTrackingModelIsNotBelieved) {
  const auto data = bench::shared_data();
  if (!data) GTEST_SKIP() << "shared data absent: set ORBITFUSE_SHARED";
  const test::TempFolder folder;
  bench::ContainerOptions container;
  container.tracking = true;
  const auto scene = bench::container_scene(*data, container);
  // No visible scene: only structure from motion is left, which merges front and back.
  const auto poses = estimate_thermal_poses(scene.session, nullptr, {}, folder.path(), {});
  if (!poses) {
    EXPECT_TRUE(poses.error().kind == ErrorKind::quality ||
                poses.error().kind == ErrorKind::unavailable)
        << poses.error().message();
    return;
  }
  // A model that does pass must be right.
  const auto error = bench::pose_error(poses->reconstruction, poses->reconstruction, scene.truth);
  EXPECT_LE(error.ate_percent, 2.0);
}

}  // namespace
}  // namespace orbitfuse
