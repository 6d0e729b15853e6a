// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/thermal_bundle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse {
namespace {

constexpr float nothing = std::numeric_limits<float>::quiet_NaN();

/// A ball on a floor. Both cameras see its stripes and its outline, the thermal one temperatures
/// that vary over the surface besides.
SceneRender ball_view(const Camera& camera, const Rigid3d& cam_from_world, bool hot) {
  SceneRender view{cv::Mat(camera.height, camera.width, CV_32F, cv::Scalar(0)),
                   cv::Mat(camera.height, camera.width, CV_32F, cv::Scalar(nothing))};
  const Rigid3d world_from_cam = cam_from_world.inverse();
  const Eigen::Vector3d origin = world_from_cam.translation;
  constexpr double radius = 0.45, floor_z = -0.4;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = world_from_cam.rotation * camera.ray_of({x + 0.5, y + 0.5});
      double depth = (floor_z - origin.z()) / ray.z();
      const double a = ray.squaredNorm(), b = origin.dot(ray),
                   root = b * b - a * (origin.squaredNorm() - radius * radius);
      if (root > 0) depth = (-b - std::sqrt(root)) / a;
      if (!(depth > 0)) continue;
      const Eigen::Vector3d p = origin + depth * ray;
      if (p.head<2>().norm() > 1.2) continue;
      view.depth.at<float>(y, x) = static_cast<float>(depth);
      const double form = (root > 0 ? 2.0 : 0.5) + (std::fmod(p.x() + 10, 0.3) < 0.15 ? 0.7 : 0);
      const double heat = std::sin(23 * p.x() + 5 * p.y()) + std::sin(19 * p.y() - 11 * p.z()) +
                          std::sin(17 * p.z() + 13 * p.x());
      view.brightness.at<float>(y, x) = static_cast<float>(hot ? 0.4 * heat - form : form);
    }
  return view;
}

struct Ball {
  SceneRenderer form = [](const Camera& camera, const Rigid3d& pose) -> Result<SceneRender> {
    return ball_view(camera, pose, false);
  };
  OrbitViews orbit;
  std::vector<PosedView> truth;
  Fit alignment;
  Progress progress;

  explicit Ball(int stations = 12) {
    const Camera camera = testing_orbit::camera(1000).scaled_to(320, 240);
    for (int i = 0; i < stations; ++i) {
      OrbitPose pose;
      pose.azimuth_deg = 30 * i, pose.elevation_deg = i % 2 == 0 ? 20 : 32, pose.radius = 2.5;
      truth.push_back({"view" + std::to_string(i), camera, cam_from_world_of(pose, camera)});
      orbit.images.push_back(ball_view(camera, truth.back().cam_from_world, true).brightness);
      orbit.stations.push_back({});
      alignment.views.push_back({truth.back(), 0.3, 100, 0.5, {}, {}});
    }
    alignment.focal_px = camera.fx;
  }

  /// Every camera nearer by a share, its focal length shorter by the same: the images hardly tell.
  void shorten(double share, double turned_deg) {
    std::mt19937 rng(3);
    std::normal_distribution<double> noise(0, turned_deg * 3.14159265358979 / 180);
    for (RenderAlignedView& view : alignment.views) {
      Rigid3d& pose = view.view.cam_from_world;
      pose.translation *= 1 - share;
      const Rigid3d turn{
          Eigen::Quaterniond(Eigen::AngleAxisd(noise(rng), Eigen::Vector3d::UnitX()) *
                             Eigen::AngleAxisd(noise(rng), Eigen::Vector3d::UnitY())),
          Eigen::Vector3d::Zero()};
      pose = turn * pose;
      view.view.camera.fx *= 1 - share, view.view.camera.fy *= 1 - share;
    }
    alignment.focal_px *= 1 - share;
  }

  Status bundle() {
    return bundle_thermal({form, orbit, progress}, {alignment.focal_px, 0.03}, {}, alignment);
  }
  double center_error(std::size_t i) const {
    return (camera_center(alignment.views[i].view.cam_from_world) -
            camera_center(truth[i].cam_from_world))
        .norm();
  }
  double focal_error() const { return alignment.focal_px / truth.front().camera.fx - 1; }
};

TEST(ThermalBundle, ACommonErrorOfFocalLengthAndDistanceGoes) {
  Ball ball;
  ball.shorten(0.012, 0.1);
  ASSERT_TRUE(ball.bundle());
  EXPECT_NEAR(ball.focal_error(), 0, 0.004);
  for (std::size_t i = 0; i < ball.truth.size(); ++i) {
    EXPECT_LT(ball.center_error(i), 0.006 * 2.5) << i;
    EXPECT_GT(ball.alignment.views[i].confirmed_patches.value_or(0), 50) << i;
    EXPECT_DOUBLE_EQ(ball.alignment.views[i].view.camera.fx, ball.alignment.focal_px);
  }
}

TEST(ThermalBundle, AViewElsewhereIsConfirmedByNobodyAndMovesNobody) {
  Ball ball;
  OrbitPose elsewhere;
  elsewhere.azimuth_deg = 30 * 4 + 6, elsewhere.elevation_deg = 20, elsewhere.radius = 2.5;
  PosedView& wrong = ball.alignment.views[4].view;
  wrong.cam_from_world = cam_from_world_of(elsewhere, wrong.camera);
  ASSERT_TRUE(ball.bundle());
  EXPECT_LT(ball.alignment.views[4].confirmed_patches.value(),
            0.4 * ball.alignment.views[8].confirmed_patches.value());
  for (std::size_t i = 0; i < ball.truth.size(); ++i)
    EXPECT_LT(i == 4 ? 0 : ball.center_error(i), 0.006 * 2.5) << i;
}

TEST(ThermalBundle, WithoutAnythingToFindNothingMoves) {
  for (const float value : {0.0F, nothing, 1e30F}) {
    Ball ball(6);
    for (cv::Mat& image : ball.orbit.images) image.setTo(value);
    ball.shorten(0.012, 0.1);
    const Fit before = ball.alignment;
    ASSERT_TRUE(ball.bundle());
    EXPECT_EQ(ball.alignment.focal_px, before.focal_px);
    for (std::size_t i = 0; i < before.views.size(); ++i) {
      EXPECT_EQ(ball.alignment.views[i].view.cam_from_world.translation,
                before.views[i].view.cam_from_world.translation);
      EXPECT_FALSE(ball.alignment.views[i].confirmed_patches);
    }
  }
  Ball blind(6);
  blind.form = [](const Camera& camera, const Rigid3d&) -> Result<SceneRender> {
    return SceneRender{cv::Mat(camera.height, camera.width, CV_32F, cv::Scalar(0)),
                       cv::Mat(camera.height, camera.width, CV_32F, cv::Scalar(nothing))};
  };
  ASSERT_TRUE(blind.bundle());
  EXPECT_EQ(blind.focal_error(), 0);
  Ball none(0);
  EXPECT_TRUE(none.bundle());
}

TEST(ThermalBundle, DeadPixelsBlindNobody) {
  Ball ball;
  for (cv::Mat& image : ball.orbit.images)
    for (int x = 5; x < 320; x += 40) image.at<float>(3, x) = nothing;
  ball.orbit.images[2].at<float>(120, 160) = nothing;
  ASSERT_TRUE(ball.bundle());
  for (const RenderAlignedView& view : ball.alignment.views)
    EXPECT_GT(view.confirmed_patches.value_or(0), 50) << view.view.name;
}

TEST(ThermalBundle, DroppedViewsLendNothing) {
  Ball ball;
  ball.alignment.views[3].verdict = {Confidence::dropped, DoubtReason::not_found, ""};
  ASSERT_TRUE(ball.bundle());
  EXPECT_FALSE(ball.alignment.views[3].confirmed_patches);
  EXPECT_GT(ball.alignment.views[2].confirmed_patches.value_or(0), 50);
  EXPECT_LT(ball.center_error(3), 0.03 * 2.5) << "edges alone hold it";
}

TEST(ThermalBundle, ARendererThatFailsIsPassedOn) {
  Ball ball;
  ball.form = [](const Camera&, const Rigid3d&) -> Result<SceneRender> {
    return fail(ErrorKind::input, "field", "cut", "train again");
  };
  const Status status = ball.bundle();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().where, "field");
}

}  // namespace
}  // namespace orbitfuse
