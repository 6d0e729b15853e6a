// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/patches/patch_alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/numeric/bilinear.hpp"
#include "core/option_range.hpp"

namespace orbitfuse {
namespace {

/// Values at the places; false where one lies outside or is not a number.
bool sample(const cv::Mat& image, const PatchPlace& place, const Eigen::Matrix2Xd& steps,
            Eigen::VectorXd& values) {
  values.resize(steps.cols());
  for (Eigen::Index i = 0; i < steps.cols(); ++i) {
    const Eigen::Vector2d p = place.centre + place.linear * steps.col(i);
    const auto found = place_among<double>(image.cols, image.rows, p.x(), p.y());
    if (!found) return false;
    values(i) = blended(*found, [&](int y, int x) -> double { return image.at<float>(y, x); });
  }
  return values.allFinite();
}

/// To mean 0 and weighted square sum 1; the contrast there was, 0 of a constant patch.
double normalize(const Eigen::VectorXd& weights, Eigen::VectorXd& values) {
  const double mean = weights.dot(values);
  values.array() -= mean;
  const double contrast = std::sqrt(weights.dot(values.cwiseAbs2()));
  // What rounding leaves of a constant is no contrast.
  if (!std::isfinite(contrast) || contrast <= 1e-6 * std::abs(mean)) return 0;
  values /= contrast;
  return contrast;
}

double larger_eigenvalue(const Eigen::Matrix2d& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues()(1);
}

}  // namespace

Status PatchOptions::validate() const {
  const OptionCheck check("patch");
  ORBITFUSE_TRY(check("radius_px", radius_px, from_to(1, 64)));
  ORBITFUSE_TRY(check("window_sigma_px", window_sigma_px, above_up_to(0, 64)));
  ORBITFUSE_TRY(check("max_iterations", max_iterations, from_to(1, 1000)));
  ORBITFUSE_TRY(check("converged_px", converged_px, above_up_to(0, 1)));
  return check("affine_damping", affine_damping, from_to(0, 1));
}

PatchTemplate::PatchTemplate(const PatchOptions& options) : options_(options) {
  const int radius = options.radius_px, side = 2 * radius + 1;
  steps_.resize(2, side * side);
  for (int i = 0; i < side * side; ++i)
    steps_.col(i) = Eigen::Vector2d(i % side - radius, i / side - radius);
  const double variance = options.window_sigma_px * options.window_sigma_px;
  weights_ = (-0.5 / variance * steps_.colwise().squaredNorm().array()).exp().transpose();
  weights_ /= weights_.sum();
}

std::optional<PatchTemplate> PatchTemplate::at(const cv::Mat& image, const Eigen::Vector2d& centre,
                                               const PatchOptions& options) {
  PatchTemplate made(options);
  const Eigen::Matrix2d upright = Eigen::Matrix2d::Identity();
  if (!sample(image, {centre, upright}, made.steps_, made.values_)) return {};
  const double contrast = normalize(made.weights_, made.values_);
  if (contrast == 0) return {};
  Eigen::Matrix2Xd gradient(2, made.steps_.cols());
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d half = 0.5 * Eigen::Vector2d::Unit(axis);
    Eigen::VectorXd before, after;
    if (!sample(image, {centre - half, upright}, made.steps_, before) ||
        !sample(image, {centre + half, upright}, made.steps_, after))
      return {};
    gradient.row(axis) = (after - before).transpose() / contrast;
  }
  if (!made.set_gradient(gradient)) return {};
  return made;
}

bool PatchTemplate::set_gradient(const Eigen::Matrix2Xd& gradient) {
  AffineRows jacobian(6, steps_.cols());
  for (Eigen::Index i = 0; i < steps_.cols(); ++i) {
    const Eigen::Vector2d g = gradient.col(i), s = steps_.col(i);
    jacobian.col(i) << g, g.x() * s, g.y() * s;
  }
  // Brightness and contrast are fitted anew at every step: what they explain moves nothing.
  for (Eigen::Index row = 0; row < 6; ++row) {
    jacobian.row(row).array() -= jacobian.row(row).dot(weights_);
    const double along = jacobian.row(row).dot(weights_.cwiseProduct(values_));
    jacobian.row(row) -= along * values_.transpose();
  }
  descent_ = jacobian * weights_.asDiagonal();
  Normal normal = descent_ * jacobian.transpose();
  const Eigen::Matrix2d shifts = normal.topLeftCorner<2, 2>();
  const double more = larger_eigenvalue(shifts), less = shifts.trace() - more;
  // Along an edge noise alone decides; that such a place is vague is told by its sigma.
  constexpr double least_share = 1e-6;
  if (!std::isfinite(more) || less <= least_share * more) return false;
  const double rim = options_.radius_px;
  normal.diagonal().tail<4>().array() += options_.affine_damping * rim * rim * shifts.trace();
  inverse_normal_ = normal.ldlt().solve(Normal::Identity());
  return inverse_normal_.allFinite();
}

double PatchTemplate::sigma_px(const AlignedPatch& patch) const {
  // Of two normalized patches; interpolation alone leaves as much.
  constexpr double least_unexplained = 1e-3;
  const double unexplained = std::max(2 - 2 * patch.correlation, least_unexplained);
  const double independent_samples = 1 / weights_.squaredNorm();
  const Eigen::Matrix2d shifts =
      patch.place.linear * inverse_normal_.topLeftCorner<2, 2>() * patch.place.linear.transpose();
  return std::sqrt(larger_eigenvalue(shifts) * unexplained / independent_samples);
}

std::optional<AlignedPatch> PatchTemplate::align(const cv::Mat& image,
                                                 const PatchPlace& start) const {
  AlignedPatch patch{.place = start};
  Eigen::VectorXd values;
  for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
    if (!sample(image, patch.place, steps_, values) || normalize(weights_, values) == 0) return {};
    patch.correlation = weights_.dot(values.cwiseProduct(values_));
    const Affine step = inverse_normal_ * (descent_ * (values - values_));
    Eigen::Matrix2d linear;
    linear << 1 + step(2), step(3), step(4), 1 + step(5);
    constexpr double folded = 0.1;
    if (!step.allFinite() || linear.determinant() < folded) return {};
    // The template would have to move by `step` to look like the image: the warp goes back.
    patch.place.linear = patch.place.linear * linear.inverse();
    const Eigen::Vector2d shift = patch.place.linear * step.head<2>();
    patch.place.centre -= shift;
    if (shift.norm() < options_.converged_px) {
      patch.sigma_px = sigma_px(patch);
      return patch;
    }
  }
  return {};
}

}  // namespace orbitfuse
