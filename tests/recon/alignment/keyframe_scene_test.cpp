// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/keyframe_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

PosedView at(double azimuth, double elevation = 14, double radius = 2.5) {
  const Camera camera = testing_orbit::camera(1000).scaled_to(320, 240);
  OrbitPose pose;
  pose.azimuth_deg = azimuth, pose.elevation_deg = elevation, pose.radius = radius;
  return {"view", camera, cam_from_world_of(pose, camera)};
}

/// The box, and how often it was rendered.
struct Counted {
  int renders = 0;
  SceneRenderer renderer = [this](const Camera& camera,
                                  const Rigid3d& pose) -> Result<SceneRender> {
    ++renders;
    return testing_orbit::box_view(camera, pose, false);
  };
};

struct Likeness {
  int on_box = 0, depth_close = 0, shade_close = 0, on_both = 0;
};

Likeness likeness(const SceneRender& seen, const SceneRender& truth) {
  Likeness likeness;
  for (int y = 0; y < truth.depth.rows; ++y)
    for (int x = 0; x < truth.depth.cols; ++x) {
      const float z = truth.depth.at<float>(y, x), ours = seen.depth.at<float>(y, x);
      likeness.on_both += std::isfinite(z) == std::isfinite(ours) ? 1 : 0;
      if (!std::isfinite(z)) continue;
      ++likeness.on_box;
      likeness.depth_close += std::abs(ours - z) < 0.02F * z ? 1 : 0;
      likeness.shade_close +=
          std::abs(seen.brightness.at<float>(y, x) - truth.brightness.at<float>(y, x)) < 0.1F ? 1
                                                                                              : 0;
    }
  return likeness;
}

TEST(KeyframeScene, AViewWithinADegreeIsMadeOfTheSameRender) {
  Counted box;
  const auto scene = keyframe_scene(box.renderer, {}, Eigen::Vector3d::Zero(), {}, {});
  ASSERT_TRUE(scene);
  const Camera camera = at(0).camera;
  ASSERT_TRUE((*scene)(camera, at(30).cam_from_world));
  EXPECT_EQ(box.renders, 1);
  const auto near = (*scene)(camera, at(30.7, 14.4, 2.52).cam_from_world);
  ASSERT_TRUE(near);
  EXPECT_EQ(box.renders, 1);
  const SceneRender truth =
      testing_orbit::box_view(camera, at(30.7, 14.4, 2.52).cam_from_world, false);
  const Likeness like = likeness(*near, truth);
  ASSERT_GT(like.on_box, 3000);
  EXPECT_GT(like.depth_close, 0.97 * like.on_box);
  EXPECT_GT(like.shade_close, 0.93 * like.on_box);
  EXPECT_GT(like.on_both, 0.99 * 320 * 240);
  ASSERT_TRUE((*scene)(camera, at(33).cam_from_world));
  EXPECT_EQ(box.renders, 2) << "too far for the first";
}

/// Pixels of a surface, and those of them that have none beside them.
struct Outline {
  double area = 0, length = 0;
};

Outline outline_of(const cv::Mat& depth) {
  Outline outline;
  const auto surface = [&](int y, int x) { return std::isfinite(depth.at<float>(y, x)); };
  for (int y = 1; y + 1 < depth.rows; ++y)
    for (int x = 1; x + 1 < depth.cols; ++x) {
      if (!surface(y, x)) continue;
      ++outline.area;
      if (!surface(y, x - 1) || !surface(y, x + 1) || !surface(y - 1, x) || !surface(y + 1, x))
        ++outline.length;
    }
  return outline;
}

// Outlines half a pixel inside the object, as they were, put thermal cameras 0.6 % too near.
TEST(KeyframeScene, OutlinesOfAViewNearByStayWhereTheyAre) {
  Counted box;
  const auto scene = keyframe_scene(box.renderer, {}, Eigen::Vector3d::Zero(), {}, {});
  ASSERT_TRUE(scene);
  const Camera camera = at(0).camera;
  ASSERT_TRUE((*scene)(camera, at(30).cam_from_world));
  double area = 0, true_area = 0, length = 0;
  for (int i = 0; i < 12; ++i) {
    const Rigid3d pose = at(30 + 0.31 * std::cos(i), 14 + 0.29 * std::sin(i)).cam_from_world;
    const auto near = (*scene)(camera, pose);
    ASSERT_TRUE(near);
    const Outline truth = outline_of(testing_orbit::box_view(camera, pose, false).depth);
    area += outline_of(near->depth).area, true_area += truth.area, length += truth.length;
  }
  ASSERT_EQ(box.renders, 1);
  ASSERT_GT(length, 12 * 200);
  EXPECT_NEAR((area - true_area) / length, 0, 0.1) << "pixels outwards";
}

TEST(KeyframeScene, CoarseViewsAreMadeOfGivenOnesHoweverFar) {
  Counted box;
  std::vector<PosedView> views;
  for (int i = 0; i < 12; ++i) views.push_back(at(30 * i, i % 2 == 0 ? 12 : 38, 1.6));
  const auto scene = keyframe_scene(box.renderer, views, Eigen::Vector3d::Zero(), {}, {});
  ASSERT_TRUE(scene);
  EXPECT_EQ(box.renders, 12);
  const Camera coarse = at(0).camera.scaled_to(160, 120);
  for (const double azimuth : {11.0, 47.0, 200.0}) {
    const Rigid3d pose = at(azimuth, 22, 2.7).cam_from_world;
    const auto seen = (*scene)(coarse, pose);
    ASSERT_TRUE(seen);
    const Likeness like = likeness(*seen, testing_orbit::box_view(coarse, pose, false));
    ASSERT_GT(like.on_box, 500);
    EXPECT_GT(like.depth_close, 0.9 * like.on_box) << azimuth;
    EXPECT_GT(like.on_both, 0.95 * 160 * 120) << azimuth;
  }
  EXPECT_EQ(box.renders, 12);
}

TEST(KeyframeScene, ARendererThatFailsIsPassedOn) {
  const SceneRenderer broken = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "cut", "train again");
  };
  const auto at_once = keyframe_scene(broken, {at(0)}, Eigen::Vector3d::Zero(), {}, {});
  ASSERT_FALSE(at_once);
  EXPECT_EQ(at_once.error().where, "field");
  const auto later = keyframe_scene(broken, {}, Eigen::Vector3d::Zero(), {}, {});
  ASSERT_TRUE(later);
  EXPECT_FALSE((*later)(at(0).camera, at(0).cam_from_world));
}

}  // namespace
}  // namespace orbitfuse
