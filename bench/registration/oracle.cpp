// SPDX-License-Identifier: BSD-3-Clause
#include "bench/registration/oracle.hpp"

#include <algorithm>
#include <cmath>

#include "core/numeric/median.hpp"
#include "recon/registration/similarity.hpp"

namespace orbitfuse::scenes {
namespace {

/// Whether some point lies within `distance` of x.
bool has_near(const Positions& points, const Eigen::Vector3d& x, double distance) {
  return std::any_of(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
    return (p - x).squaredNorm() < distance * distance;
  });
}

/// Tukey's weights from the residuals of a fit, 4.685 robust standard deviations.
std::vector<double> tukey_weights(const Positions& from, const Positions& to,
                                  const Similarity3d& fit) {
  std::vector<double> residuals;
  for (std::size_t i = 0; i < from.size(); ++i) residuals.push_back((fit * from[i] - to[i]).norm());
  // The median length of a three-dimensional normal vector is 1.538 standard deviations.
  const double bound = 4.685 * median(residuals) / 1.538;
  for (double& r : residuals) {
    const double u = r / std::max(bound, 1e-12), v = 1 - u * u;
    r = v > 0 ? v * v : 0;
  }
  return residuals;
}

}  // namespace

std::optional<Similarity3d> oracle_similarity(const CloudPair& pair, Oracle kind) {
  Positions from, to;
  for (std::size_t i = 0; i < pair.source_truth.size(); ++i) {
    const Eigen::Vector3d& truth = pair.source_truth[i];
    if (!truth.allFinite()) continue;
    if (kind != Oracle::all_points && !has_near(pair.target.positions, truth, 0.03 * pair.diameter))
      continue;
    from.push_back(pair.source.positions[i]);
    to.push_back(truth);
  }
  Result<Similarity3d> fit = registration::umeyama(from, to);
  if (kind == Oracle::robust_common) {
    for (int i = 0; i < 10 && fit; ++i)
      fit = registration::umeyama(from, to, tukey_weights(from, to, *fit));
  }
  if (!fit) return std::nullopt;
  return *fit;
}

}  // namespace orbitfuse::scenes
