// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/transform.hpp"
#include "core/result.hpp"

namespace orbitfuse::registration {

using Points = std::vector<Eigen::Vector3d>;

/// Least-squares similarity, target = s R source + t (Umeyama 1991, eq. 40-43, reflections
/// excluded). Weights may be empty. Input errors: fewer than 3 pairs, different counts, values that
/// are not finite, sources or targets in one place or on one line (R or s is not determined).
Result<Similarity3d> umeyama(const Points& source, const Points& target,
                             const std::vector<double>& weights = {});

struct RobustSimilarity {
  Similarity3d target_from_source;
  std::vector<double> weights;  ///< 0..1 per pair
  double inlier_ratio = 0;
};
/// Graduated non-convexity with truncated least squares (Yang et al. 2020) round umeyama; pairs
/// further off than the bound (target units) end with weight 0. Errors: umeyama's, and usage for a
/// bound that is not above 0.
Result<RobustSimilarity> robust_umeyama(const Points& source, const Points& target,
                                        double inlier_bound);

}  // namespace orbitfuse::registration
