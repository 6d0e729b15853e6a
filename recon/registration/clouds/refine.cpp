// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/refine.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/geometry/rotation_vector.hpp"
#include "core/numeric/median.hpp"
#include "recon/registration/clouds/pairs.hpp"

namespace orbitfuse::registration {
namespace {

struct Equations {
  // Rows and columns 0-6: the hessian; 7: the gradient. Eight by eight fills whole registers.
  Eigen::Matrix<double, 8, 8> sums = Eigen::Matrix<double, 8, 8>::Zero();
  double weight = 0;
  std::vector<double> distances;  ///< |plane distance| of the pairs
};

/// Where the source's centre, the origin of its unit frame, lies in the target.
Eigen::Vector3d placed_center(const Similarity3d& target_from_source) {
  return target_from_source.translation;
}

void add(Equations& equations, const Pair& pair, double bound) {
  const double w = pair.trust * tukey(pair.residual, bound);
  equations.distances.push_back(std::abs(pair.residual));
  if (w <= 0) return;
  Eigen::Matrix<double, 8, 1> j;
  j << plane_jacobian(pair.lever, pair.normal), pair.residual;
  equations.sums.noalias() += (w * j).lazyProduct(j.transpose());
  equations.weight += w;
}

Equations equations_at(const PreparedCloud& source, const PreparedCloud& target,
                       const std::vector<int>& source_subset, const std::vector<int>& target_subset,
                       const Similarity3d& placement, double pair_bound, double plane_bound,
                       bool exact) {
  Equations equations;
  equations.distances.reserve(source_subset.size() + target_subset.size());
  const Pairs pairs(source, target, placement, pair_bound, exact, no_displacement);
  Pair pair;
  for (const int i : source_subset) {
    if (pairs.forward(static_cast<std::size_t>(i), pair)) add(equations, pair, plane_bound);
  }
  for (const int j : target_subset) {
    if (pairs.backward(static_cast<std::size_t>(j), pair)) add(equations, pair, plane_bound);
  }
  return equations;
}

double adapted_bound(double sigma, double pair_bound) {
  constexpr double floor = 0.004;  // or exact data would leave no pair
  return std::clamp(tukey_sigmas * sigma, floor, pair_bound);
}

/// Radians, log of the scale, radii: beyond, the partners no longer are what was solved for.
constexpr double most_update = 0.3;

bool enough(const Equations& equations) {
  return equations.distances.size() >= fewest_pairs && equations.weight > 0;
}

}  // namespace

double robust_sigma(std::vector<double>& sizes) { return sigma_of_median * median_in(sizes); }

Vector7 plane_jacobian(const Eigen::Vector3d& lever, const Eigen::Vector3d& normal) {
  Vector7 j;
  j << lever.cross(normal), lever.dot(normal), normal;
  return j;
}

Similarity3d updated(const Similarity3d& target_from_source, const Eigen::Vector3d& center,
                     const Vector7& update) {
  const Eigen::Quaterniond turn = turned_by(update.head<3>());
  const double grow = std::exp(update[3]);
  Similarity3d result;
  result.scale = grow * target_from_source.scale;
  result.rotation = (turn * target_from_source.rotation).normalized();
  result.translation =
      center + grow * (turn * (target_from_source.translation - center)) + update.tail<3>();
  return result;
}

Refined refine(const PreparedCloud& source, const PreparedCloud& target,
               const std::vector<int>& source_subset, const std::vector<int>& target_subset,
               const Similarity3d& start, const RefineOptions& options) {
  Refined refined{start, Matrix7::Zero(), 0, 0};
  const double shrink = options.iterations > 1 ? std::pow(options.end_bound / options.start_bound,
                                                          1.0 / (options.iterations - 1))
                                               : 1.0;
  double bound = options.start_bound, sigma = bound;
  for (int iteration = 0; iteration < options.iterations + options.polish; ++iteration) {
    const double plane_bound = options.adapt_bound ? adapted_bound(sigma, bound) : bound;
    Equations equations =
        equations_at(source, target, source_subset, target_subset, refined.target_from_source,
                     bound, plane_bound, options.exact_partners);
    if (!enough(equations)) break;
    if (options.adapt_bound) sigma = robust_sigma(equations.distances);
    refined.hessian = equations.sums.topLeftCorner<7, 7>() / equations.weight;
    refined.residual_sigma = sigma;
    refined.pairs = static_cast<int>(equations.distances.size());
    Vector7 update = -damped(equations.sums.topLeftCorner<7, 7>(), equations.weight)
                          .ldlt()
                          .solve(equations.sums.col(7).head<7>());
    if (!update.allFinite()) break;
    const double longest =
        std::max({update.head<3>().norm(), std::abs(update[3]), update.tail<3>().norm()});
    if (longest > most_update) update *= most_update / longest;
    refined.target_from_source =
        updated(refined.target_from_source, placed_center(refined.target_from_source), update);
    if (iteration < options.iterations) bound = std::max(options.end_bound, bound * shrink);
    if (iteration >= options.iterations && longest < options.settled) break;
  }
  return refined;
}

Refined measured_at(const PreparedCloud& source, const PreparedCloud& target,
                    const std::vector<int>& source_subset, const std::vector<int>& target_subset,
                    const Similarity3d& placement, const RefineOptions& options) {
  const double bound = options.end_bound;
  Refined measured{placement, Matrix7::Zero(), bound, 0};
  for (const bool sigma_known : {false, true}) {
    const double plane_bound =
        sigma_known && options.adapt_bound ? adapted_bound(measured.residual_sigma, bound) : bound;
    Equations equations = equations_at(source, target, source_subset, target_subset, placement,
                                       bound, plane_bound, options.exact_partners);
    if (!enough(equations)) break;
    if (options.adapt_bound) measured.residual_sigma = robust_sigma(equations.distances);
    measured.hessian = equations.sums.topLeftCorner<7, 7>() / equations.weight;
    measured.pairs = static_cast<int>(equations.distances.size());
  }
  return measured;
}

}  // namespace orbitfuse::registration
