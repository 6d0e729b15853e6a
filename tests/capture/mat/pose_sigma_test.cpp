// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/pose_sigma.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <random>

#include "capture/guide/coverage.hpp"

namespace orbitfuse {
namespace {

const cv::Matx33d k(500, 0, 320, 0, 500, 240, 0, 0, 1);

/// A camera 1.2 m from the mat's middle, 35 degrees high, at azimuth 20 degrees.
void look(cv::Mat& r, cv::Mat& t) {
  const double azimuth = 20 * M_PI / 180, elevation = 35 * M_PI / 180;
  const cv::Vec3d eye(1.2 * std::cos(elevation) * std::cos(azimuth),
                      1.2 * std::cos(elevation) * std::sin(azimuth), 1.2 * std::sin(elevation));
  const cv::Vec3d z = -eye / cv::norm(eye), x = cv::normalize(z.cross({0, 0, 1})), y = z.cross(x);
  const cv::Matx33d rotation(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]);
  cv::Rodrigues(rotation, r);
  t = cv::Mat(rotation * -eye).clone();
}

MatCorners seen(const std::vector<cv::Point3d>& points, const cv::Mat& r, const cv::Mat& t) {
  MatCorners corners;
  corners.mat = points;
  cv::projectPoints(points, r, t, k, cv::noArray(), corners.image);
  return corners;
}

std::vector<cv::Point3d> square() {
  std::vector<cv::Point3d> points;
  for (double y : {-0.3, -0.1, 0.1, 0.3}) {
    for (double x : {-0.3, -0.1, 0.1, 0.3}) points.push_back({x, y, 0});
  }
  return points;
}

class PoseSigma : public testing::Test {
 protected:
  PoseSigma() { look(r, t); }
  cv::Mat r, t;
};

/// The stated sigma is the spread of poses that are fitted to noisy corners.
TEST_F(PoseSigma, AgreesWithTheSpreadOfNoisyFits) {
  const MatCorners exact = seen(square(), r, t);
  const Eigen::Vector2d truth = angles_of(pose_of(r, t));
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.5);
  double squares[2]{};
  constexpr int fits = 400;
  for (int fit = 0; fit < fits; ++fit) {
    MatCorners noisy = exact;
    for (cv::Point2d& p : noisy.image) p += cv::Point2d(noise(random), noise(random));
    cv::Mat r_fit = r.clone(), t_fit = t.clone();
    cv::solvePnP(noisy.mat, noisy.image, k, cv::noArray(), r_fit, t_fit, true);
    const Eigen::Vector2d angles = angles_of(pose_of(r_fit, t_fit));
    for (int i = 0; i < 2; ++i)
      squares[i] += std::pow(angle_difference_deg(angles[i], truth[i]), 2);
  }
  const double spread = std::sqrt(std::max(squares[0], squares[1]) / fits);
  EXPECT_NEAR(direction_sigma_deg(exact, k, r, t, 0.5) / spread, 1, 0.15);
}

TEST_F(PoseSigma, PointsOnOneLineDetermineNothing) {
  std::vector<cv::Point3d> line;
  for (int i = 0; i < 8; ++i) line.push_back({-0.3 + 0.08 * i, 0.1, 0});
  EXPECT_TRUE(std::isinf(direction_sigma_deg(seen(line, r, t), k, r, t, 0.3)));
}

TEST_F(PoseSigma, TooFewPointsDetermineNothing) {
  std::vector<cv::Point3d> points = square();
  for (std::size_t count : {2u, 1u, 0u}) {
    points.resize(count);
    MatCorners corners;
    if (count > 0) corners = seen(points, r, t);
    EXPECT_TRUE(std::isinf(direction_sigma_deg(corners, k, r, t, 0.3))) << count;
  }
  EXPECT_TRUE(std::isinf(reprojection_rms_px({}, k, r, t)));
}

TEST_F(PoseSigma, PointsAndPosesThatAreNoNumbersDetermineNothing) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  MatCorners corners = seen(square(), r, t);
  EXPECT_TRUE(std::isinf(direction_sigma_deg(corners, k, r, t, nan)));
  corners.mat[3].x = nan;
  EXPECT_TRUE(std::isinf(direction_sigma_deg(corners, k, r, t, 0.3)));
  corners = seen(square(), r, t);
  t.at<double>(2) = nan;
  EXPECT_TRUE(std::isinf(direction_sigma_deg(corners, k, r, t, 0.3)));
}

}  // namespace
}  // namespace orbitfuse
