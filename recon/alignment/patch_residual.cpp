// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/patch_residual.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/geometry/rotation_vector.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {

CorrectedPose::CorrectedPose(const double* correction)
    : translation(Eigen::Map<const Eigen::Vector3d>(correction + 3)) {
  const Eigen::Vector3d axis_angle = Eigen::Map<const Eigen::Vector3d>(correction);
  const double square = axis_angle.squaredNorm(), angle = std::sqrt(square);
  // Below, the series' next terms are smaller than rounding.
  constexpr double small = 1e-4;
  const double sine = angle < small ? 1 - square / 6 : std::sin(angle) / angle;
  const double cosine = angle < small ? 0.5 - square / 24 : (1 - std::cos(angle)) / square;
  const double third = angle < small ? 1.0 / 6 - square / 120 : (1 - sine) / square;
  const Eigen::Matrix3d turn = cross_matrix(axis_angle), twice = turn * turn;
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  rotation = one + sine * turn + cosine * twice;
  right_jacobian = one - cosine * turn + third * twice;
}

std::optional<CorrectedPixel> corrected_pixel(const Camera& camera, const CorrectedPose& correction,
                                              double log_focal, double radial,
                                              const Eigen::Vector3d& point) {
  const Eigen::Vector3d moved = correction.rotation * point + correction.translation;
  if (!(moved.z() > 1e-6)) return std::nullopt;
  const double x = moved.x() / moved.z(), y = moved.y() / moved.z(), square = x * x + y * y;
  const double focal = std::exp(log_focal), bent = 1 + radial * square;
  const Eigen::Vector2d focal_px(focal * camera.fx, focal * camera.fy), at(x, y);

  CorrectedPixel seen;
  seen.by_log_focal = bent * focal_px.cwiseProduct(at);
  seen.pixel = seen.by_log_focal + Eigen::Vector2d(camera.cx, camera.cy);
  seen.by_radial = square * focal_px.cwiseProduct(at);
  const Eigen::Matrix2d by_at = focal_px.asDiagonal() * (bent * Eigen::Matrix2d::Identity() +
                                                         2 * radial * at * at.transpose());
  Eigen::Matrix<double, 2, 3> at_by_moved;
  at_by_moved << 1, 0, -x, 0, 1, -y;
  const Eigen::Matrix<double, 2, 3> by_moved = by_at * at_by_moved / moved.z();
  seen.by_point = by_moved * correction.rotation;
  seen.by_correction << -seen.by_point * cross_matrix(point) * correction.right_jacobian, by_moved;
  return seen;
}

std::optional<Eigen::Vector2d> patch_residual(const PatchMatch& match, const Camera& camera,
                                              const CorrectedPose& correction, double log_focal,
                                              double radial) {
  const auto seen = corrected_pixel(camera, correction, log_focal, radial, match.point);
  if (!seen) return std::nullopt;
  return match.sqrt_weight * (seen->pixel - match.seen);
}

PatchFit patch_fit(const std::vector<PatchMatch>& matches, const Camera& camera,
                   const CorrectedPose& correction, double log_focal, double radial) {
  std::vector<double> distances;
  for (const PatchMatch& match : matches) {
    const auto residual = patch_residual(match, camera, correction, log_focal, radial);
    if (residual && residual->norm() < 2) distances.push_back(residual->norm());
  }
  return {static_cast<int>(distances.size()), median(distances)};
}

bool PatchCost::Evaluate(const double* const* parameters, double* residuals,
                         double** jacobians) const {
  const auto seen = corrected_pixel(camera_, CorrectedPose(parameters[0]), *parameters[1],
                                    *parameters[2], match_.point);
  if (!seen) return false;
  const Eigen::Matrix2d& weight = match_.sqrt_weight;
  Eigen::Map<Eigen::Vector2d> values(residuals);
  values = weight * (seen->pixel - match_.seen);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> to(jacobians[0]);
    to = weight * seen->by_correction;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Vector2d> to(jacobians[1]);
    to = weight * seen->by_log_focal;
  }
  if (jacobians[2] != nullptr) {
    Eigen::Map<Eigen::Vector2d> to(jacobians[2]);
    to = weight * seen->by_radial;
  }
  return true;
}

}  // namespace orbitfuse
