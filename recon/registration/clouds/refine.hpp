// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "recon/registration/clouds/prepared_cloud.hpp"

namespace orbitfuse::registration {

/// A small similarity about a centre c, applied on the target's side:
/// y -> c + exp(sigma) exp(omega) (y - c) + t, ordered (omega, sigma, t).
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;
Similarity3d updated(const Similarity3d& target_from_source, const Eigen::Vector3d& center,
                     const Vector7& update);

/// Derivative of the plane distance n (T x - q) by the update, at lever = point - centre: the moved
/// source point against a target plane; or, against a source plane that turns with the update, the
/// target point (d r/d omega = (z - c) x n to first order).
Vector7 plane_jacobian(const Eigen::Vector3d& lever, const Eigen::Vector3d& normal);

/// Normal equations whose open directions stay where they are; `weight`: of all their pairs.
inline Matrix7 damped(Matrix7 hessian, double weight) {
  hessian.diagonal().array() += 1e-4 * weight;
  return hessian;
}

struct RefineOptions {
  double start_bound = 0.25;  ///< partners further apart (target unit lengths) don't pull, at first
  double end_bound = 0.08;    ///< and at last
  int iterations = 12;        ///< over which the bound shrinks
  int polish = 8;             ///< at the last bound, until the update vanishes
  bool exact_partners = true;  ///< false: a table cell's error is far below the bounds
  bool adapt_bound = true;     ///< Tukey bound from the residuals' spread, where that is smaller
  double settled = 1e-6;       ///< polishing ends at updates below this
};

struct Refined {
  Similarity3d target_from_source;
  Matrix7 hessian = Matrix7::Zero();  ///< per unit of weight, about the source's centre
  /// Robust spread of the plane distances, target unit lengths; the start bound unless adapt_bound.
  double residual_sigma = 0;
  int pairs = 0;
};

/// Point-to-plane from both sides with Tukey's weights, Gauss-Newton over the seven parameters of
/// a similarity. One-sided versions shrink the source into the target's surface.
Refined refine(const PreparedCloud& source, const PreparedCloud& target,
               const std::vector<int>& source_subset, const std::vector<int>& target_subset,
               const Similarity3d& start, const RefineOptions& options);

/// What refine() says of its result (hessian, residual_sigma, pairs), for any other placement.
Refined measured_at(const PreparedCloud& source, const PreparedCloud& target,
                    const std::vector<int>& source_subset, const std::vector<int>& target_subset,
                    const Similarity3d& placement, const RefineOptions& options);

}  // namespace orbitfuse::registration
