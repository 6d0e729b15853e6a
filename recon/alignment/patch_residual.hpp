// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/geometry/camera.hpp"
#include "recon/alignment/patch_matching.hpp"

// Residuals of what a pose's correction (pose_correction.hpp) and a lens are found from, with their
// derivatives by hand: automatic ones take several times as long.
namespace orbitfuse {

/// Where a camera whose pose and lens are corrected sees a point, and how that changes.
struct CorrectedPixel {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 6> by_correction;
  Eigen::Vector2d by_log_focal, by_radial;
  Eigen::Matrix<double, 2, 3> by_point;
};

/// A correction as it is applied to many points.
struct CorrectedPose {
  /// Angle-axis and translation, six numbers.
  explicit CorrectedPose(const double* correction);
  explicit CorrectedPose(const std::array<double, 6>& c) : CorrectedPose(c.data()) {}
  Eigen::Matrix3d rotation;
  Eigen::Matrix3d right_jacobian;  ///< turn about its own axes by change of the angle-axis vector
  Eigen::Vector3d translation;
};

/// `log_focal`: logarithm of what `camera`'s
/// focal lengths are scaled by; `radial`: k1 of its lens (Brown, normalised coordinates), beside
/// none of its own; `point`: in the camera's axes, before the correction. None behind the camera.
/// The rotated point's derivative: Gallego and Yezzi, A compact formula for the derivative of a 3-D
/// rotation in exponential coordinates, 2015.
std::optional<CorrectedPixel> corrected_pixel(const Camera& camera, const CorrectedPose& correction,
                                              double log_focal, double radial,
                                              const Eigen::Vector3d& point);

/// Weighted pixels from where a correction of the pose and of the lens puts a patch to where it was
/// found; none behind the camera.
std::optional<Eigen::Vector2d> patch_residual(const PatchMatch& match, const Camera& camera,
                                              const CorrectedPose& correction, double log_focal,
                                              double radial = 0);

/// How well patches agree on a correction.
struct PatchFit {
  int matches = 0;       ///< within 2 px of it
  double median_px = 0;  ///< their residual; 0 of none
};
PatchFit patch_fit(const std::vector<PatchMatch>& matches, const Camera& camera,
                   const CorrectedPose& correction, double log_focal, double radial = 0);

/// Ceres cost of `patch_residual`: correction, log_focal, radial.
class PatchCost final : public ceres::SizedCostFunction<2, 6, 1, 1> {
 public:
  PatchCost(const PatchMatch& match, const Camera& camera) : match_(match), camera_(camera) {}
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  PatchMatch match_;
  Camera camera_;
};

}  // namespace orbitfuse
