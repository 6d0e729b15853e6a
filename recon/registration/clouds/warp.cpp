// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/warp.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

#include "recon/registration/clouds/candidate.hpp"
#include "recon/registration/clouds/pairs.hpp"
#include "recon/registration/clouds/warp_grid.hpp"

namespace orbitfuse::registration {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Index = Eigen::Index;

/// Displacements of equal covariance in x, y and z, none between them; amplitude 1.
struct Prior {
  Matrix covariance, precision;  ///< of one coordinate
  double log_determinant = 0;    ///< of the covariance of all three

  Prior(const Points& nodes, double length) {
    const auto n = static_cast<Index>(nodes.size());
    covariance.resize(n, n);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) {
        const double d2 =
            (nodes[static_cast<std::size_t>(i)] - nodes[static_cast<std::size_t>(j)]).squaredNorm();
        covariance(i, j) = std::exp(-0.5 * d2 / (length * length));
      }
    }
    const Eigen::LLT<Matrix> factors(covariance);
    precision = factors.solve(Matrix::Identity(n, n));
    log_determinant = 6 * factors.matrixLLT().diagonal().array().log().sum();
  }
};

/// Normal equations of residual = y + J u + n . d, with u the similarity's update, d the nodes'
/// displacements and y the residual without them.
struct WarpEquations {
  Matrix nodes;  ///< d against d
  Matrix mixed;  ///< d against (u, y)
  Eigen::Matrix<double, 8, 8> similarity = Eigen::Matrix<double, 8, 8>::Zero();  ///< (u, y)
  double weight = 0;
  std::vector<double> distances;  ///< |residual| of the pairs, warp included
};

/// One cell's share: rows 0-23 its corners' displacements, 24-31 (u, y).
using Block = Eigen::Matrix<double, 32, 32>;

void scatter(const Block& block, const std::array<int, WarpGrid::cell_corners>& corners,
             WarpEquations& equations) {
  for (Index a = 0; a < WarpGrid::cell_corners; ++a) {
    const Index to = 3 * corners[static_cast<std::size_t>(a)];
    equations.mixed.middleRows<3>(to) += block.block<3, 8>(3 * a, 24);
    for (Index b = 0; b < WarpGrid::cell_corners; ++b) {
      equations.nodes.block<3, 3>(to, 3 * corners[static_cast<std::size_t>(b)]) +=
          block.block<3, 3>(3 * a, 3 * b);
    }
  }
  equations.similarity += block.bottomRightCorner<8, 8>();
}

WarpEquations equations_at(const PreparedCloud& source, const PreparedCloud& target,
                           const Similarity3d& placement, const WarpGrid& grid, double pair_bound,
                           double plane_bound) {
  WarpEquations equations;
  const auto unknowns = 3 * static_cast<Index>(grid.nodes().size());
  equations.nodes.setZero(unknowns, unknowns);
  equations.mixed.setZero(unknowns, 8);
  std::vector<Block> blocks(grid.cell_count(), Block::Zero());
  const auto add = [&](const Pair& pair) {
    const std::optional<WarpGrid::Place> place = grid.place(pair.at);
    if (!place) return;
    equations.distances.push_back(std::abs(pair.residual));
    const double w = pair.trust * tukey(pair.residual, plane_bound);
    if (w <= 0) return;
    Eigen::Matrix<double, 32, 1> row;
    for (Index k = 0; k < WarpGrid::cell_corners; ++k)
      row.segment<3>(3 * k) = place->weights[static_cast<std::size_t>(k)] * pair.normal;
    row.segment<7>(24) = plane_jacobian(pair.lever, pair.normal);
    row[31] = pair.residual - pair.normal.dot(grid.displacement(*place));
    blocks[place->cell].noalias() += (w * row).lazyProduct(row.transpose());
    equations.weight += w;
  };
  const Pairs pairs(source, target, placement, pair_bound, true, grid);
  Pair pair;
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    if (pairs.forward(i, pair)) add(pair);
  }
  for (std::size_t j = 0; j < target.points.size(); ++j) {
    if (pairs.backward(j, pair)) add(pair);
  }
  for (std::size_t c = 0; c < blocks.size(); ++c) scatter(blocks[c], grid.corners(c), equations);
  return equations;
}

/// The displacements' own equations, the similarity eliminated; in units of the noise.
class Displacements {
 public:
  Displacements(const WarpEquations& equations, double sigma, const Prior& prior)
      : prior_(prior), mixed_(equations.mixed) {
    similarity_.compute(damped(equations.similarity.topLeftCorner<7, 7>(), equations.weight));
    gradient_ = equations.similarity.col(7).head<7>();
    const auto coupling = mixed_.leftCols<7>();
    const double precision = 1 / (sigma * sigma);
    data_ = precision * (equations.nodes - coupling * similarity_.solve(coupling.transpose()));
    pull_ = precision * (mixed_.col(7) - coupling * similarity_.solve(gradient_));
  }

  /// Whether the evidence rises from amplitude 0 on (its derivative by the squared amplitude).
  bool any() const {
    double for_it = 0, against = 0;
    const Index n = prior_.covariance.rows();
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) {
        const double k = prior_.covariance(i, j);
        for_it += k * pull_.segment<3>(3 * i).dot(pull_.segment<3>(3 * j));
        against += k * data_.block<3, 3>(3 * i, 3 * j).trace();
      }
    }
    return for_it > against;
  }

  /// Log evidence over that of amplitude 0; `displacements` are the likeliest.
  double gain(double amplitude, Vector* displacements = nullptr) const {
    Matrix posterior = data_;
    const double tightness = 1 / (amplitude * amplitude);
    const Index n = prior_.precision.rows();
    for (Index j = 0; j < n; ++j) {
      for (Index i = j; i < n; ++i) {
        posterior.block<3, 3>(3 * i, 3 * j).diagonal().array() +=
            tightness * prior_.precision(i, j);
      }
    }
    const Eigen::LLT<Matrix> factors(posterior);  // reads the lower half only
    if (factors.info() != Eigen::Success) return -INFINITY;
    const Vector pulled = factors.solve(pull_);
    if (displacements) *displacements = -pulled;
    const double log_posterior = 2 * factors.matrixLLT().diagonal().array().log().sum();
    const double log_prior =
        prior_.log_determinant - 3.0 * static_cast<double>(n) * std::log(tightness);
    return 0.5 * (pull_.dot(pulled) - log_posterior - log_prior);
  }

  Vector7 update(const Vector& displacements) const {
    const Vector7 pull = gradient_ + mixed_.leftCols<7>().transpose() * displacements;
    return -similarity_.solve(pull);
  }

 private:
  const Prior& prior_;
  Matrix mixed_, data_;
  Vector pull_;
  Vector7 gradient_;
  Eigen::LDLT<Matrix7> similarity_;
};

/// Largest evidence over amplitudes, to an eighth of a factor of two: up a ladder, then between.
std::pair<double, double> likeliest_amplitude(const Displacements& displacements, double most) {
  double best = 0, best_gain = 0;
  for (double a = most / 64; a <= most; a *= 2) {
    const double gain = displacements.gain(a);
    if (gain > best_gain) {
      best = a;
      best_gain = gain;
    } else if (best > 0) {
      break;
    }
  }
  for (double step = std::sqrt(2.0); best > 0 && step > 1.1; step = std::sqrt(step)) {
    for (const double a : {best / step, best * step}) {
      const double gain = a <= most ? displacements.gain(a) : 0;
      if (gain <= best_gain) continue;
      best = a;
      best_gain = gain;
      break;
    }
  }
  return {best, best_gain};
}

Points paired_points(const PreparedCloud& source, const PreparedCloud& target,
                     const Similarity3d& placement, double bound) {
  const Pairs pairs(source, target, placement, bound, true, no_displacement);
  Points points;
  Pair pair;
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    if (pairs.forward(i, pair)) points.push_back(pair.at);
  }
  return points;
}

}  // namespace

Unwarped refine_beside_warp(const PreparedCloud& source, const PreparedCloud& target,
                            const Refined& start, const WarpOptions& options) {
  constexpr double node_spacing =
      1.2;  // of the length: finer gains nothing and costs its sixth power
  constexpr int fewest_points = 8;
  constexpr std::size_t most_nodes = 120;  // objects have about 60; bounds the time for others
  constexpr int amplitude_rounds = 3;      // then it stays, or the updates would not settle
  Unwarped result;
  result.target_from_source = start.target_from_source;
  const auto without = [&result](WarpOutcome outcome) {
    result.outcome = outcome;
    result.amplitude = 0;
    return result;
  };
  WarpGrid grid(paired_points(source, target, start.target_from_source, options.pair_bound),
                node_spacing * options.length, fewest_points, most_nodes);
  if (grid.nodes().empty()) return without(WarpOutcome::too_little);
  const Prior prior(grid.nodes(), grid.spacing() / node_spacing);
  Similarity3d placement = start.target_from_source;
  double sigma = start.residual_sigma;
  for (int round = 0; round < options.rounds; ++round) {
    sigma = std::max(sigma, options.min_sigma);
    WarpEquations equations = equations_at(source, target, placement, grid, options.pair_bound,
                                           std::min(tukey_sigmas * sigma, options.pair_bound));
    if (equations.distances.size() < fewest_pairs || !(equations.weight > 0))
      return without(round == 0 ? WarpOutcome::too_little : WarpOutcome::diverged);
    const Displacements displacements(equations, sigma, prior);
    if (round == 0 && !displacements.any()) return without(WarpOutcome::none);
    if (round < amplitude_rounds) {
      std::tie(result.amplitude, result.gain) =
          likeliest_amplitude(displacements, options.max_amplitude);
      if (result.gain < options.min_gain) return without(WarpOutcome::none);
    }
    Vector by_node;
    const double gain = displacements.gain(result.amplitude, &by_node);
    if (!std::isfinite(gain)) return without(WarpOutcome::diverged);
    const Vector7 update = displacements.update(by_node);
    if (!update.allFinite()) return without(WarpOutcome::diverged);
    grid.displace(by_node);
    placement = updated(placement, placement.translation, update);
    if (distinct(placement, start.target_from_source)) return without(WarpOutcome::diverged);
    sigma = robust_sigma(equations.distances);
    if (update.norm() < 1e-4) break;
  }
  result.target_from_source = placement;
  // The amplitudes tried are a fifth apart.
  result.outcome =
      result.amplitude < 0.99 * options.max_amplitude ? WarpOutcome::found : WarpOutcome::at_limit;
  return result;
}

}  // namespace orbitfuse::registration
