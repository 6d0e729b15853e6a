// SPDX-License-Identifier: BSD-3-Clause
// The azimuth while the mat is out of sight: a walk in a rendered room, the mat covered on the way.
#include "capture/mat/scene_odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "capture/mat/mat_finder.hpp"
#include "core/system/clock.hpp"
#include "tests/capture/mat/rendered_room.hpp"
#include "tests/support/rendered_mat.hpp"

namespace orbitfuse {
namespace {

struct Walk {
  const char* name;
  double elevation_deg, step_deg;  ///< between looks, four a second
};

double elevation_deg(const Eigen::Vector3d& eye) {
  return std::atan2(eye.z(), std::hypot(eye.x(), eye.y())) * 180 / M_PI;
}

class OdometryWalk : public testing::TestWithParam<Walk> {};

TEST_P(OdometryWalk, AzimuthIsKeptWhileTheMatIsHidden) {
  const Walk walk = GetParam();
  const MatDesign design{};
  const Camera camera = Camera::from_fov(480, 360, 60);
  const cv::Mat mat = test::printed_mat(black_rectangles(design), design.size_m, 0.0005);
  const double hidden_from_deg = 40, hidden_to_deg = 130, end_deg = 150;
  MatFinder finder(design);
  finder.set_focal_px(Modality::visible, camera.fx);
  OrbitPlan plan;
  plan.loop_elevations_deg = {walk.elevation_deg};
  plan.modalities = {Modality::visible};
  Coverage coverage(plan);
  double worst_deg = 0, worst_in_sigmas = 0, last_sigma_deg = 0;
  double hidden_s = 0, seen_s = 0;
  int seen_looks = 0, read = 0, looks = 0, followed = 0, green = 0, false_green = 0;
  for (double azimuth = 0; azimuth < end_deg; azimuth += walk.step_deg) {
    const bool hidden = azimuth >= hidden_from_deg && azimuth < hidden_to_deg;
    // A hand is no rail: nearer and further, up and down, the aim wanders.
    const double elevation = walk.elevation_deg + 1.5 * std::sin(0.2 * azimuth);
    Rigid3d pose = test::orbit_pose(azimuth, elevation, 1.2 + 0.05 * std::sin(0.13 * azimuth));
    const Eigen::Quaterniond aim(
        Eigen::AngleAxisd(0.03 * std::sin(0.31 * azimuth), Eigen::Vector3d(0.6, 0.8, 0)));
    pose = {aim * pose.rotation, aim * pose.translation};
    const cv::Mat image = test::view_of_room(hidden ? cv::Mat() : mat, design.size_m, camera, pose);
    const double before_s = cpu_seconds();
    const auto sighting = finder.find(image, Modality::visible);
    (hidden ? hidden_s : seen_s) += cpu_seconds() - before_s;
    if (!hidden) {
      ++seen_looks;
      read += sighting && !sighting->followed;
      continue;
    }
    ++looks;
    if (!sighting) continue;
    ++followed;
    EXPECT_TRUE(sighting->followed);
    const Eigen::Vector3d eye = camera_center(pose);
    const double truth = std::atan2(eye.y(), eye.x()) * 180 / M_PI;
    const double error = std::abs(angle_difference_deg(sighting->position.azimuth_deg, truth));
    worst_deg = std::max(worst_deg, error);
    worst_in_sigmas = std::max(worst_in_sigmas, error / sighting->position.sigma_deg);
    last_sigma_deg = sighting->position.sigma_deg;
    FrameAssessment frame;
    frame.file = std::to_string(looks);
    frame.sharpness = 1;
    frame.position = sighting->position;
    frame.position->speed_deg_s = 0;
    if (coverage.add(frame) != Refusal::none) continue;
    ++green;
    // What counts is where the camera was, whatever sigma says.
    const double seen_from_deg = elevation_deg(eye);
    false_green += error > 1 || std::abs(sighting->position.elevation_deg - seen_from_deg) > 1;
  }
  std::printf(
      "%s: %d of %d looks followed over 90 deg (mat read %d times), worst azimuth error %.2f deg, "
      "%.2f sigma; sigma at the end %.2f deg; %d green, %d of them false; "
      "%.0f CPU ms a look with the mat, %.0f without\n",
      walk.name, followed, looks, read, worst_deg, worst_in_sigmas, last_sigma_deg, green,
      false_green, 1e3 * seen_s / seen_looks, 1e3 * hidden_s / looks);
  EXPECT_GE(read, 10);
  EXPECT_GE(followed, looks * 9 / 10);
  EXPECT_LE(worst_deg, 2);
  EXPECT_LE(worst_in_sigmas, 2);
  EXPECT_GT(last_sigma_deg, CoverageOptions{}.max_sigma_deg) << "after so long it proves nothing";
  EXPECT_EQ(false_green, 0);
  EXPECT_GE(green, 1) << "none of them was judged";
}

INSTANTIATE_TEST_SUITE_P(All, OdometryWalk,
                         testing::Values(Walk{"SlowAt30", 30, 2}, Walk{"SlowAt20", 20, 2},
                                         Walk{"SlowAt55", 55, 2}, Walk{"BriskAt30", 30, 5}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(SceneOdometry, SaysNothingWithoutAReadingOrWithoutAScene) {
  SceneOdometry odometry(0.6);
  const Camera camera = Camera::from_fov(320, 240, 60);
  const cv::Mat room = test::view_of_room({}, 0.6, camera, test::orbit_pose(0, 30, 1.2));
  EXPECT_FALSE(odometry.follow(room, camera.fx));
  odometry.remember(room, camera.fx, test::orbit_pose(0, 30, 1.2), 0.1);
  EXPECT_FALSE(odometry.follow(room, camera.fx)) << "one view triangulates nothing";
  const cv::Mat blank(240, 320, CV_8UC1, cv::Scalar(80));
  odometry.remember(blank, camera.fx, test::orbit_pose(3, 30, 1.2), 0.1);
  EXPECT_FALSE(odometry.follow(blank, camera.fx));
}

TEST(SceneOdometry, AnotherSceneOrSizeIsNotFollowed) {
  SceneOdometry odometry(0.6);
  const Camera camera = Camera::from_fov(320, 240, 60);
  for (double azimuth = 0; azimuth <= 8; azimuth += 2) {
    const Rigid3d pose = test::orbit_pose(azimuth, 30, 1.2);
    odometry.remember(test::view_of_room({}, 0.6, camera, pose), camera.fx, pose, 0.1);
  }
  EXPECT_FALSE(odometry.follow(test::view_of_room({}, 0.6, camera, test::orbit_pose(120, 30, 1.2)),
                               camera.fx));
  EXPECT_FALSE(odometry.follow(cv::Mat(120, 160, CV_8UC1, cv::Scalar(7)), camera.fx / 2));
  const auto back =
      odometry.follow(test::view_of_room({}, 0.6, camera, test::orbit_pose(9, 30, 1.2)), camera.fx);
  ASSERT_TRUE(back) << "two bad looks are ridden over";
  EXPECT_GT(back->landmarks, 14);
}

}  // namespace
}  // namespace orbitfuse
