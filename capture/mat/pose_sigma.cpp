// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/pose_sigma.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "capture/guide/coverage.hpp"
#include "core/numeric/angle_units.hpp"

namespace orbitfuse {

static constexpr double unknown = std::numeric_limits<double>::infinity();

PoseVector pose_of(const cv::Mat& r, const cv::Mat& t) {
  PoseVector pose;
  for (int i = 0; i < 3; ++i) {
    pose[i] = r.at<double>(i);
    pose[3 + i] = t.at<double>(i);
  }
  return pose;
}

Rigid3d rigid_of(const PoseVector& pose) {
  const Eigen::Vector3d r = pose.head<3>();
  const double angle = r.norm();
  const Eigen::AngleAxisd rotation(
      angle, angle > 0 ? Eigen::Vector3d(r / angle) : Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(rotation), pose.tail<3>()};
}

Eigen::Vector2d angles_of(const PoseVector& pose) { return angles_of(rigid_of(pose)); }

Eigen::Vector2d angles_of(const Rigid3d& cam_from_mat) {
  const Eigen::Vector3d eye = camera_center(cam_from_mat);
  return {std::atan2(eye.y(), eye.x()) * degrees_per_radian,
          std::atan2(eye.z(), std::hypot(eye.x(), eye.y())) * degrees_per_radian};
}

double reprojection_rms_px(const MatCorners& corners, const cv::Matx33d& k, const cv::Mat& r,
                           const cv::Mat& t) {
  if (corners.mat.empty()) return unknown;
  std::vector<cv::Point2d> projected;
  cv::projectPoints(corners.mat, r, t, k, cv::noArray(), projected);
  double sum = 0;
  for (std::size_t i = 0; i < projected.size(); ++i) {
    const cv::Point2d d = projected[i] - corners.image[i];
    sum += d.dot(d);
  }
  return std::sqrt(sum / static_cast<double>(projected.size()));
}

double direction_sigma_deg(const MatCorners& corners, const cv::Matx33d& k, const cv::Mat& r,
                           const cv::Mat& t, double error_px) {
  if (corners.mat.empty() || !std::isfinite(error_px)) return unknown;
  std::vector<cv::Point2d> projected;
  cv::Mat jacobian;
  cv::projectPoints(corners.mat, r, t, k, cv::noArray(), projected, jacobian);
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  for (int row = 0; row < jacobian.rows; ++row) {
    PoseVector j;
    for (int i = 0; i < 6; ++i) j[i] = jacobian.at<double>(row, i);
    information += j * j.transpose();
  }
  // Scaled to a unit diagonal, so that radians and metres weigh alike.
  const PoseVector scale = information.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return unknown;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> shape(
      scale.asDiagonal() * information * scale.asDiagonal());
  if (!(shape.eigenvalues()[0] > 1e-10)) return unknown;
  const Eigen::Matrix<double, 6, 6> covariance =
      information.ldlt().solve(Eigen::Matrix<double, 6, 6>::Identity()) *
      std::pow(std::max(error_px, 0.1), 2);
  const PoseVector pose = pose_of(r, t);
  const Eigen::Vector2d here = angles_of(pose);
  double worst = 0;
  for (int angle = 0; angle < 2; ++angle) {
    PoseVector gradient;
    for (int i = 0; i < 6; ++i) {
      const double step = 1e-6 * std::max(1.0, std::abs(pose[i]));
      PoseVector moved = pose;
      moved[i] += step;
      gradient[i] = angle_difference_deg(angles_of(moved)[angle], here[angle]) / step;
    }
    const double variance = gradient.dot(covariance * gradient);
    if (!std::isfinite(variance)) return unknown;
    worst = std::max(worst, variance);
  }
  return std::sqrt(worst);
}

}  // namespace orbitfuse
