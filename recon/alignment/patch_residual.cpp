// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/patch_residual.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace orbitfuse {
namespace {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// A rotation, and the turn about its own axes that a change of its angle-axis vector makes.
struct Rotation {
  Eigen::Matrix3d matrix, right_jacobian;
};

Rotation rotation_of(const Eigen::Vector3d& axis_angle) {
  const double square = axis_angle.squaredNorm(), angle = std::sqrt(square);
  // Below, the series' next terms are smaller than rounding.
  constexpr double small = 1e-4;
  const double sine = angle < small ? 1 - square / 6 : std::sin(angle) / angle;
  const double cosine = angle < small ? 0.5 - square / 24 : (1 - std::cos(angle)) / square;
  const double third = angle < small ? 1.0 / 6 - square / 120 : (1 - sine) / square;
  const Eigen::Matrix3d turn = cross_matrix(axis_angle), twice = turn * turn;
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  return {one + sine * turn + cosine * twice, one - cosine * turn + third * twice};
}

/// `corrected_pixel`, less the place it was found at.
std::optional<CorrectedPixel> patch_pixel(const PatchMatch& match, const Camera& camera,
                                          const double* correction, double log_focal,
                                          double radial) {
  auto seen = corrected_pixel(camera, correction, log_focal, radial, match.point);
  if (seen) seen->pixel -= match.seen;
  return seen;
}

}  // namespace

std::optional<CorrectedPixel> corrected_pixel(const Camera& camera, const double* correction,
                                              double log_focal, double radial,
                                              const Eigen::Vector3d& point) {
  const Rotation rotation = rotation_of(Eigen::Map<const Eigen::Vector3d>(correction));
  const Eigen::Vector3d moved =
      rotation.matrix * point + Eigen::Map<const Eigen::Vector3d>(correction + 3);
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
  seen.by_point = by_moved * rotation.matrix;
  seen.by_correction << -seen.by_point * cross_matrix(point) * rotation.right_jacobian, by_moved;
  return seen;
}

std::optional<Eigen::Vector2d> patch_residual(const PatchMatch& match, const Camera& camera,
                                              const double* correction, double log_focal) {
  const auto seen = patch_pixel(match, camera, correction, log_focal, 0);
  if (!seen) return std::nullopt;
  return match.sqrt_weight * seen->pixel;
}

bool PatchCost::Evaluate(const double* const* parameters, double* residuals,
                         double** jacobians) const {
  const auto seen = patch_pixel(match_, camera_, parameters[0], *parameters[1], 0);
  if (!seen) return false;
  const Eigen::Matrix2d& weight = match_.sqrt_weight;
  Eigen::Map<Eigen::Vector2d> values(residuals);
  values = weight * seen->pixel;
  if (jacobians == nullptr) return true;
  put_jacobian<6>(weight * seen->by_correction, jacobians[0]);
  put_jacobian<1>(weight * seen->by_log_focal, jacobians[1]);
  return true;
}

bool BentPatchCost::Evaluate(const double* const* parameters, double* residuals,
                             double** jacobians) const {
  const auto seen = patch_pixel(match_, camera_, parameters[0], *parameters[1], *parameters[2]);
  if (!seen) return false;
  const Eigen::Matrix2d& weight = match_.sqrt_weight;
  Eigen::Map<Eigen::Vector2d> values(residuals);
  values = weight * seen->pixel;
  if (jacobians == nullptr) return true;
  put_jacobian<6>(weight * seen->by_correction, jacobians[0]);
  put_jacobian<1>(weight * seen->by_log_focal, jacobians[1]);
  put_jacobian<1>(weight * seen->by_radial, jacobians[2]);
  return true;
}

}  // namespace orbitfuse
