// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_finder.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/support/rendered_mat.hpp"

namespace orbitfuse {
namespace {

using test::orbit_pose;
using test::printed_mat;
using test::view_of_mat;

const MatDesign design{};
const Camera camera = Camera::from_fov(640, 480, 50);

cv::Mat mat_image() {
  static const cv::Mat image = printed_mat(black_rectangles(design), design.size_m, 0.0005);
  return image;
}

cv::Mat view(double azimuth_deg, double elevation_deg, double distance_m = 1.0) {
  return view_of_mat(mat_image(), design.size_m, camera,
                     orbit_pose(azimuth_deg, elevation_deg, distance_m));
}

TEST(MatFinder, AzimuthAndElevationWithinADegree) {
  MatFinder finder(design);
  finder.set_focal_px(Modality::visible, camera.fx);
  for (const double elevation : {10.0, 30.0, 55.0}) {
    for (const double azimuth : {3.0, 140.0, 275.0}) {
      const auto found = finder.find(view(azimuth, elevation), Modality::visible);
      ASSERT_TRUE(found) << azimuth << " " << elevation;
      EXPECT_LE(std::abs(angle_difference_deg(found->position.azimuth_deg, azimuth)), 0.5)
          << azimuth << " " << elevation;
      EXPECT_NEAR(found->position.elevation_deg, elevation, 1.0) << azimuth;
      EXPECT_LT(found->position.sigma_deg, 1);
      EXPECT_GT(found->position.sigma_deg, 0);
    }
  }
}

TEST(MatFinder, LearnsTheFocalLength) {
  MatFinder finder(design);
  EXPECT_FALSE(finder.focal_px(Modality::visible));
  for (const double azimuth : {10.0, 130.0, 250.0}) {
    const auto found = finder.find(view(azimuth, 35), Modality::visible);
    ASSERT_TRUE(found);
    EXPECT_LE(std::abs(angle_difference_deg(found->position.azimuth_deg, azimuth)), 1);
    EXPECT_NEAR(found->position.elevation_deg, 35, 2);
  }
  EXPECT_NEAR(*finder.focal_px(Modality::visible) / camera.fx, 1, 0.05);
}

TEST(MatFinder, ObjectInTheMiddleAndColourImages) {
  MatFinder finder(design);
  finder.set_focal_px(Modality::visible, camera.fx);
  cv::Mat image = view(200, 40);
  cv::circle(image, {320, 230}, 100, cv::Scalar(90), -1);
  cv::Mat colour;
  cv::cvtColor(image, colour, cv::COLOR_GRAY2BGR);
  const auto found = finder.find(colour, Modality::visible);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->position.azimuth_deg, 200, 0.5);
  EXPECT_LT(found->tags, design.tags());
}

TEST(MatFinder, FoilAndPaintInEitherPolarity) {
  const MatDesign foil = MatDesign::for_thermal(0.6);
  const cv::Mat page = printed_mat(black_rectangles(foil), foil.size_m, 0.0005);
  for (const bool paint_is_warmer : {true, false}) {
    // A small soft thermal image: paint at 300 K, foil 12 K away from it, noise of 0.1 K.
    const Camera thermal = Camera::from_fov(320, 240, 45);
    const cv::Mat gray = view_of_mat(page, foil.size_m, thermal, orbit_pose(75, 35, 0.9));
    cv::Mat soft, centikelvin, noise(gray.size(), CV_16SC1);
    cv::GaussianBlur(gray, soft, {}, 0.6);
    soft.convertTo(centikelvin, CV_16U, paint_is_warmer ? -6.0 : 6.0, 30000);
    cv::RNG random(7);
    random.fill(noise, cv::RNG::NORMAL, 0, 10);
    cv::add(centikelvin, noise, centikelvin, cv::noArray(), CV_16U);
    centikelvin.at<std::uint16_t>(5, 5) = 60000;  // a hot spot must not flatten the rest
    centikelvin.at<std::uint16_t>(6, 6) = 0;
    MatFinder finder(foil);
    finder.set_focal_px(Modality::thermal, thermal.fx);
    const auto found = finder.find(centikelvin, Modality::thermal);
    ASSERT_TRUE(found) << paint_is_warmer;
    EXPECT_NEAR(found->position.azimuth_deg, 75, 1);
    EXPECT_NEAR(found->position.elevation_deg, 35, 1.5);
  }
}

TEST(MatFinder, LargePhotosAreReducedNotMisread) {
  const Camera photo = Camera::from_fov(2400, 1800, 50);
  MatFinderOptions options;
  options.largest_side_px = 800;
  MatFinder finder(design, options);
  finder.set_focal_px(Modality::visible, photo.fx);
  const auto found = finder.find(
      view_of_mat(mat_image(), design.size_m, photo, orbit_pose(310, 30, 1.0)), Modality::visible);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->position.azimuth_deg, 310, 0.5);
}

TEST(MatFinder, NothingIsFoundWhereNothingIs) {
  MatFinder finder(design);
  cv::Mat noise(480, 640, CV_8UC1);
  cv::RNG random(3);
  random.fill(noise, cv::RNG::UNIFORM, 0, 255);
  EXPECT_FALSE(finder.find(noise, Modality::visible));
  EXPECT_FALSE(finder.find(cv::Mat(480, 640, CV_8UC1, cv::Scalar(100)), Modality::visible));
  EXPECT_FALSE(finder.find(cv::Mat(480, 640, CV_16UC1, cv::Scalar(0)), Modality::thermal));
  EXPECT_FALSE(finder.find(cv::Mat(), Modality::visible));
  EXPECT_FALSE(finder.find(cv::Mat(4, 4, CV_8UC1, cv::Scalar(1)), Modality::visible));
  EXPECT_FALSE(finder.find(cv::Mat(480, 640, CV_32FC1, cv::Scalar(1)), Modality::visible));
}

TEST(MatFinder, MirroredMatIsNotTakenForTheMat) {
  // Seen in a shiny car door the mat is mirrored: its tags must not count.
  MatFinder finder(design);
  finder.set_focal_px(Modality::visible, camera.fx);
  cv::Mat mirrored;
  cv::flip(view(60, 40), mirrored, 1);
  EXPECT_FALSE(finder.find(mirrored, Modality::visible));
}

TEST(MatFinder, FollowsTheMatWhereItsTagsCannotBeRead) {
  MatFinder finder(design);
  finder.set_focal_px(Modality::visible, camera.fx);
  ASSERT_TRUE(finder.find(view(50, 35), Modality::visible));
  // Blurred just so far that nothing can be read.
  cv::Mat soft;
  for (double sigma = 1; sigma < 6; sigma += 0.25) {
    cv::GaussianBlur(view(50.5, 35), soft, {}, sigma);
    MatFinder fresh(design);
    fresh.set_focal_px(Modality::visible, camera.fx);
    if (!fresh.find(soft, Modality::visible)) break;
  }
  const auto followed = finder.find(soft, Modality::visible);
  ASSERT_TRUE(followed);
  EXPECT_TRUE(followed->followed);
  EXPECT_NEAR(followed->position.azimuth_deg, 50.5, 2);
  // It steers, but proves no station.
  Coverage coverage(OrbitPlan{});
  FrameAssessment frame;
  frame.file = "x";
  frame.sharpness = 1;
  frame.position = followed->position;
  EXPECT_EQ(coverage.add(frame), Refusal::position_unsure);
  EXPECT_FALSE(finder.find(cv::Mat(480, 640, CV_8UC1, cv::Scalar(9)), Modality::visible));
  EXPECT_FALSE(finder.find(soft, Modality::visible)) << "once lost it has to be read again";
}

TEST(FocalEstimate, FrontalViewsSayNothing) {
  FocalEstimate estimate;
  estimate.add(Eigen::Vector3d(500, 500, 1).asDiagonal(), 640);
  EXPECT_FALSE(estimate.focal_px());
  estimate.add(Eigen::Matrix3d::Constant(std::nan("")), 640);
  EXPECT_FALSE(estimate.focal_px());
}

TEST(MatFinder, OptionsAreChecked) {
  MatFinderOptions options;
  EXPECT_TRUE(options.validate());
  options.min_tags = 0;
  EXPECT_EQ(options.validate().error().where, "mat.min_tags");
  options = {};
  options.max_error_px = 0;
  EXPECT_FALSE(options.validate());
}

}  // namespace
}  // namespace orbitfuse
