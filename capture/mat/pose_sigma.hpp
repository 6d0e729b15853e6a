// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "capture/mat/mat_tracker.hpp"
#include "core/geometry/transform.hpp"

namespace orbitfuse {

using PoseVector = Eigen::Matrix<double, 6, 1>;  ///< rotation vector, translation

PoseVector pose_of(const cv::Mat& rotation, const cv::Mat& translation);
Rigid3d rigid_of(const PoseVector& cam_from_mat);

/// Azimuth (-180..180) and elevation of the camera in the mat's frame, degrees.
Eigen::Vector2d angles_of(const PoseVector& cam_from_mat);
Eigen::Vector2d angles_of(const Rigid3d& cam_from_mat);

/// Root mean square reprojection error of `corners` in pixels; infinite without any.
double reprojection_rms_px(const MatCorners& corners, const cv::Matx33d& k, const cv::Mat& rotation,
                           const cv::Mat& translation);

/// One standard deviation of the direction in degrees: pixel noise through the fit's Jacobian.
/// Infinite when the corners don't determine the pose (fewer than three, on one line, not numbers).
double direction_sigma_deg(const MatCorners& corners, const cv::Matx33d& k, const cv::Mat& rotation,
                           const cv::Mat& translation, double error_px);

}  // namespace orbitfuse
