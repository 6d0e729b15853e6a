// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/pose_steps.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/numeric/random.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

/// A wavy surface with a smooth pattern, as any camera near the origin sees it.
float pattern(const Eigen::Vector3d& p) {
  return static_cast<float>(0.5 + 0.2 * std::sin(9 * p.x() + 3 * p.y()) +
                            0.2 * std::cos(8 * p.y() - 2 * p.x()));
}

double surface_z(double x, double y) { return 1 + 0.15 * std::sin(4 * x) * std::cos(3 * y); }

/// Distance along a ray to it.
double distance_to_surface(const Ray& ray) {
  double t = 1;
  for (int i = 0; i < 60; ++i) {
    const double x = ray.origin[0] + t * ray.direction[0], y = ray.origin[1] + t * ray.direction[1],
                 z = ray.origin[2] + t * ray.direction[2];
    t += (surface_z(x, y) - z) / ray.direction[2];
  }
  return t;
}

Eigen::Vector3d point_at(const Ray& ray, double t) {
  return {ray.origin[0] + t * ray.direction[0], ray.origin[1] + t * ray.direction[1],
          ray.origin[2] + t * ray.direction[2]};
}

NormalisedView photo_from(const Rigid3d& cam_from_world, double k1) {
  Camera camera = Camera::from_fov(80, 60, 50);
  camera.k1 = k1;
  NormalisedView view{
      "photo", ViewRays(camera, cam_from_world, {}), cv::Mat(60, 80, CV_32FC1), {}, {}};
  Ray ray;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x)
      view.target.at<float>(y, x) = view.rays.ray(x + 0.5, y + 0.5, ray)
                                        ? pattern(point_at(ray, distance_to_surface(ray)))
                                        : nan;
  return view;
}

/// What a perfect field shows from where the view is taken to be.
PoseSums sums_of_truth(const NormalisedView& view) {
  PoseSums sums;
  Ray ray;
  for (int y = 0; y < view.target.rows; ++y)
    for (int x = 0; x < view.target.cols; ++x) {
      if (!view.rays.ray(x + 0.5, y + 0.5, ray)) continue;
      const double t = distance_to_surface(ray);
      const float shown = pattern(point_at(ray, t));
      add_ray(view, x, y, &shown, static_cast<float>(t), sums);
    }
  return sums;
}

/// RMS of what a perfect field shows from there less the photo.
double picture_error(const NormalisedView& view) {
  double sum = 0;
  Ray ray;
  for (int y = 0; y < view.target.rows; ++y)
    for (int x = 0; x < view.target.cols; ++x)
      if (view.rays.ray(x + 0.5, y + 0.5, ray))
        sum += std::pow(
            pattern(point_at(ray, distance_to_surface(ray))) - view.target.at<float>(y, x), 2);
  return std::sqrt(sum / static_cast<double>(view.target.total()));
}

Rigid3d pose(double turn_deg, double shift) {
  const double a = turn_deg * 3.14159265358979 / 180;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(a, Eigen::Vector3d(0.5, 0.7, -0.4).normalized())),
          shift * Eigen::Vector3d(0.6, -0.5, 0.6)};
}

TEST(PoseSteps, FindTheWayHome) {
  for (const double k1 : {0.0, -0.2}) {
    NormalisedView view = photo_from(pose(0, 0), k1);
    view.rays = ViewRays(view.rays.camera(), pose(0.8, 0.012), {});
    RefinedPose refined = unmoved(pose(0.8, 0.012));
    for (int i = 0; i < 40; ++i)
      ASSERT_TRUE(take_step(sums_of_truth(view), {}, refined, view, {.noise = 1e-3}));
    EXPECT_LT(rotation_angle_deg(refined.pose().rotation, Eigen::Quaterniond::Identity()), 0.01)
        << k1;
    EXPECT_LT(camera_center(refined.pose()).norm(), 1e-4) << k1;
  }
}

TEST(PoseSteps, KeepToTheGivenPoseWhereAPictureSaysLittle) {
  NormalisedView view = photo_from(pose(0, 0), 0);
  view.rays = ViewRays(view.rays.camera(), pose(0.8, 0.012), {});
  const double before = picture_error(view);
  RefinedPose refined = unmoved(pose(0.8, 0.012));
  for (int i = 0; i < 40; ++i) ASSERT_TRUE(take_step(sums_of_truth(view), {}, refined, view));
  EXPECT_LT(picture_error(view), 0.7 * before);
  EXPECT_GT(picture_error(view), 0.1 * before);
  EXPECT_LT(rotation_angle_deg(refined.pose().rotation, Eigen::Quaterniond::Identity()), 0.8);
}

TEST(PoseSteps, StayAtHome) {
  NormalisedView view = photo_from(pose(0, 0), -0.2);
  RefinedPose refined = unmoved(pose(0, 0));
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(take_step(sums_of_truth(view), {}, refined, view));
  EXPECT_LT(rotation_angle_deg(refined.pose().rotation, Eigen::Quaterniond::Identity()), 1e-4);
  EXPECT_LT(camera_center(refined.pose()).norm(), 1e-6);
}

TEST(PoseSteps, AreShortHoweverMuchIsAsked) {
  NormalisedView view = photo_from(pose(0, 0), 0);
  PoseSums sums = sums_of_truth(view);
  for (double& v : sums.right) v = 1e9;
  RefinedPose refined = unmoved(pose(0, 0));
  ASSERT_TRUE(take_step(sums, {}, refined, view));
  EXPECT_LE(rotation_angle_deg(refined.pose().rotation, Eigen::Quaterniond::Identity()), 1.001);
  EXPECT_LE(refined.pose().translation.norm(), 0.02001);
}

TEST(PoseSteps, ThatNothingSupportsAreNotTaken) {
  const auto expect_none = [](const PoseSums& sums) {
    NormalisedView view = photo_from(pose(0, 0), 0);
    RefinedPose refined = unmoved(pose(0, 0));
    EXPECT_FALSE(take_step(sums, {}, refined, view));
    EXPECT_EQ(refined.pose().translation.norm(), 0);
    EXPECT_EQ(view.rays.origin().norm(), 0);
  };
  expect_none({});
  NormalisedView view = photo_from(pose(0, 0), 0);
  PoseSums few;
  const float shown = 0.5f;
  for (int i = 0; i < 10; ++i) add_ray(view, 20 + i, 20, &shown, 1, few);
  EXPECT_EQ(few.rays, 10);
  expect_none(few);
  PoseSums broken = sums_of_truth(view);
  broken.right[2] = nan;
  expect_none(broken);
  PoseSums nothing;  // border, behind the camera, dead pixels, a broken distance
  add_ray(view, 0, 0, &shown, 1, nothing);
  add_ray(view, 79, 59, &shown, 1, nothing);
  add_ray(view, 20, 20, &shown, 0, nothing);
  add_ray(view, 20, 20, &shown, -1, nothing);
  add_ray(view, 20, 20, &shown, nan, nothing);
  view.target.setTo(nan);
  add_ray(view, 20, 20, &shown, 1, nothing);
  EXPECT_EQ(nothing.rays, 0);
  EXPECT_EQ(nothing.right, PoseSums().right);
  expect_none(nothing);
}

TEST(PoseSteps, OfAConstantPhotoKeepThePose) {
  NormalisedView view = photo_from(pose(0, 0), 0);
  view.target.setTo(0.5);
  RefinedPose refined = unmoved(pose(0, 0));
  take_step(sums_of_truth(view), {}, refined, view);
  EXPECT_LT(refined.pose().translation.norm(), 1e-12);
}

/// A ring of cameras, those that train turned and moved a little.
Dataset shaken_scene(Modality modality, double turn_deg) {
  Dataset data = test::toy_scene(modality, 24, 1, 64);
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    TrainingView& view = data.views[i];
    if (i % 4 == 0) {
      view.measure_only = true;
      continue;
    }
    const auto draw = [&](unsigned k) { return turn_deg * 0.03 * (random_uniform(5, k, i) - 0.5); };
    const Eigen::Vector3d turn(draw(0), draw(1), draw(2)), shift(draw(3), draw(4), draw(5));
    view.cam_from_world =
        Rigid3d{Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())), shift} *
        view.cam_from_world;
  }
  return data;
}

TEST(PoseRefinement, WinsBackWhatWrongPosesCost) {
  const auto psnr_with = [](double turn_deg, bool refine) {
    TrainOptions options = test::toy_options(Modality::visible, 400);
    options.refine_poses = refine;
    options.keep_best = false;
    Field field;
    const auto report = train(shaken_scene(Modality::visible, turn_deg), options, {}, field);
    EXPECT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->refined_poses.size(), refine ? 24u : 0u);
    return report->best_psnr;
  };
  const double exact = psnr_with(0, false), given = psnr_with(2, false);
  EXPECT_GT(exact, given + 2);  // or there is nothing to win
  const double refined = psnr_with(2, true);
  EXPECT_GT(refined, given + 0.15 * (exact - given));
  EXPECT_GT(psnr_with(0, true), exact - 1);  // smooth pictures hold a pose badly
}

TEST(PoseRefinement, GoesOnWhereACheckpointLeftIt) {
  const Dataset data = shaken_scene(Modality::thermal, 2);
  TrainOptions options = test::toy_options(Modality::thermal, 120);
  options.refine_poses = true;
  options.checkpoint = std::filesystem::path(::testing::TempDir()) / "poses.bin";
  std::filesystem::remove(options.checkpoint);
  Field field;
  const auto first = train(data, options, {}, field);
  ASSERT_TRUE(first) << first.error().message();
  options.resume = true;  // nothing is left to do
  Field again;
  const auto second = train(data, options, {}, again);
  ASSERT_TRUE(second) << second.error().message();
  for (const auto& [view, pose] : first->refined_poses) {
    EXPECT_EQ(pose.translation, second->refined_poses.at(view).translation) << view;
    EXPECT_EQ(pose.rotation.coeffs(), second->refined_poses.at(view).rotation.coeffs()) << view;
  }
  const TrainingView& moved = data.views[1];
  EXPECT_GT(
      (first->refined_poses.at(moved.name).translation - moved.cam_from_world.translation).norm(),
      1e-5);
}

TEST(PoseRefinement, BrokenOffAndResumedEndsWhereAnUnbrokenRunEnds) {
  const orbitfuse::test::TempFolder folder;
  const Dataset data = shaken_scene(Modality::thermal, 2);
  TrainOptions options = test::toy_options(Modality::thermal, 160);
  options.refine_poses = true;
  Field field;
  const auto unbroken = train(data, options, {}, field);
  ASSERT_TRUE(unbroken) << unbroken.error().message();

  options.checkpoint = folder / "poses.bin";
  test::StopAt stop(80);
  ASSERT_FALSE(train(data, options, stop.progress, field));
  options.resume = true;
  const auto resumed = train(data, options, {}, field);
  ASSERT_TRUE(resumed) << resumed.error().message();
  ASSERT_EQ(resumed->refined_poses.size(), data.views.size());
  for (const auto& [view, pose] : unbroken->refined_poses) {
    EXPECT_EQ(pose.translation, resumed->refined_poses.at(view).translation) << view;
    EXPECT_EQ(pose.rotation.coeffs(), resumed->refined_poses.at(view).rotation.coeffs()) << view;
  }
}

}  // namespace
}  // namespace orbitfuse::nerf
