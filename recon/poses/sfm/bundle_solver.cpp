// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/bundle_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>
#include <utility>

#include "core/geometry/rotation_vector.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse {
namespace {

/// A node is a view or a lens. A view has six unknowns (turn and centre), the other two are held.
constexpr int node_size = 8;
using Block = Eigen::Matrix<double, node_size, node_size>;
using NodeVector = Eigen::Matrix<double, node_size, 1>;
using ByNode = Eigen::Matrix<double, 2, node_size>;
using NodeByPoint = Eigen::Matrix<double, node_size, 3>;

/// Of the pairs of nodes, how many may see a point for the equations to be solved sparsely: with
/// many, as when all look at one object, the factors fill up.
constexpr double few_pairs = 0.25;
/// A pivot that is less of its diagonal is what rounding left of nothing.
constexpr double least_pivot = 1e-13;

/// A residual and its derivatives, weighted.
struct LinearSeen {
  ByNode by_view, by_lens;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Vector2d residual;
};

/// project() and its derivatives; a point behind the camera has none, and a large residual.
LinearSeen linear_seen(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& center,
                       const Intrinsics& lens, const Eigen::Vector3d& point,
                       const SeenPoint& seen) {
  LinearSeen out;
  const Eigen::Vector3d x = rotation * (point - center);
  if (!(x.z() > 1e-9)) {
    out.by_view.setZero(), out.by_lens.setZero(), out.by_point.setZero();
    out.residual.setConstant(1e3);
    return out;
  }
  const auto& [fx, fy, cx, cy, k1, k2, p1, p2] = lens;
  const double inverse = 1 / x.z(), u = x.x() * inverse, v = x.y() * inverse;
  const double r2 = u * u + v * v, radial = 1 + r2 * (k1 + r2 * k2), slope = k1 + 2 * k2 * r2;
  const double bent_u = u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u);
  const double bent_v = v * radial + p1 * (r2 + 2 * v * v) + 2 * p2 * u * v;
  const double mixed = 2 * u * v * slope + 2 * p1 * u + 2 * p2 * v;
  Eigen::Matrix2d by_uv;
  by_uv << fx * (radial + 2 * u * u * slope + 2 * p1 * v + 6 * p2 * u), fx * mixed, fy * mixed,
      fy * (radial + 2 * v * v * slope + 6 * p1 * v + 2 * p2 * u);
  Eigen::Matrix<double, 2, 3> uv_by_x;
  uv_by_x << inverse, 0, -u * inverse, 0, inverse, -v * inverse;
  const double unit = 1 / seen.unit_px;
  const Eigen::Matrix<double, 2, 3> by_x = unit * by_uv * uv_by_x;
  out.by_point.noalias() = by_x * rotation;
  out.by_view << -by_x * cross_matrix(x), -out.by_point, Eigen::Matrix2d::Zero();
  out.by_lens << bent_u, 0, 1, 0, fx * u * r2, fx * u * r2 * r2, fx * 2 * u * v,
      fx * (r2 + 2 * u * u),  //
      0, bent_v, 0, 1, fy * v * r2, fy * v * r2 * r2, fy * (r2 + 2 * v * v), fy * 2 * u * v;
  out.by_lens *= unit;
  out.residual = unit * (Eigen::Vector2d(fx * bent_u + cx, fy * bent_v + cy) - seen.pixel);
  return out;
}

/// The prior's residuals and derivatives, of what is not held: a held value that is not its mean
/// would drown all else.
void linear_belief(const LensBelief& belief, const Intrinsics& lens, Block& by_lens,
                   NodeVector& residual) {
  by_lens.setZero(), residual.setZero();
  for (std::size_t k = 0; k < lens.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    if (belief.held[k]) continue;
    by_lens(i, i) = 1 / belief.sigma[k];
    residual(i) = (lens[k] - belief.mean[k]) / belief.sigma[k];
  }
  if (belief.held[1]) return;
  residual(1) = (lens[1] / lens[0] - belief.mean[1] / belief.mean[0]) / belief.aspect_sigma;
  by_lens(1, 1) = 1 / (lens[0] * belief.aspect_sigma);
  by_lens(1, 0) = -lens[1] / (lens[0] * lens[0] * belief.aspect_sigma);
}

bool all_held(const std::vector<bool>& held) {
  return std::all_of(held.begin(), held.end(), [](bool one) { return one; });
}

}  // namespace

BundleSolver::BundleSolver(State start, std::vector<int> lens_of, std::vector<LensBelief> beliefs,
                           std::vector<SeenPoint> seen, double loss_scale, std::size_t dense_up_to)
    : state_(std::move(start)),
      lens_of_(std::move(lens_of)),
      beliefs_(std::move(beliefs)),
      seen_(std::move(seen)),
      loss_scale_(loss_scale),
      dense_up_to_(dense_up_to),
      parts_(state_.center.size() > dense_up_to ? 2 : 8) {
  assert(std::is_sorted(seen_.begin(), seen_.end(),
                        [](const SeenPoint& a, const SeenPoint& b) { return a.point < b.point; }));
  const std::size_t views = state_.center.size(), nodes = views + state_.lens.size();
  first_seen_.assign(state_.point.size() + 1, seen_.size());
  for (std::size_t s = seen_.size(); s-- > 0;)
    first_seen_[static_cast<std::size_t>(seen_[s].point)] = s;
  for (std::size_t p = state_.point.size(); p-- > 0;)
    first_seen_[p] = std::min(first_seen_[p], first_seen_[p + 1]);  // a point that nobody sees
  std::vector<bool> of_view(node_size, false);
  of_view[6] = of_view[7] = true;
  held_.assign(views, of_view);
  for (const LensBelief& belief : beliefs_)
    held_.emplace_back(belief.held.begin(), belief.held.end());

  block_at_.assign(nodes * nodes, -1);
  const auto join = [&](std::size_t a, std::size_t b) {
    int& at = block_at_[std::max(a, b) * nodes + std::min(a, b)];
    if (at < 0) at = blocks_++;
  };
  for (std::size_t n = 0; n < nodes; ++n) join(n, n);
  for (std::size_t p = 0; p < state_.point.size(); ++p)
    for (std::size_t s = first_seen_[p]; s < first_seen_[p + 1]; ++s)
      for (std::size_t t = first_seen_[p]; t < first_seen_[p + 1]; ++t) {
        const auto a = static_cast<std::size_t>(seen_[s].view),
                   b = static_cast<std::size_t>(seen_[t].view);
        const auto lens_a = views + static_cast<std::size_t>(lens_of_[a]),
                   lens_b = views + static_cast<std::size_t>(lens_of_[b]);
        join(a, b), join(a, lens_b), join(lens_a, lens_b);
      }
}

void BundleSolver::hold_rotation(std::size_t view) { std::fill_n(held_[view].begin(), 3, true); }

void BundleSolver::hold_center(std::size_t view, int axis) {
  held_[view][static_cast<std::size_t>(3 + axis)] = true;
}

/// One solve, as minimise() wants it.
struct BundleSolver::Problem {
  using State = BundleSolver::State;
  const BundleSolver& of;

  struct Linear {
    double cost = 0;
    std::vector<LinearSeen> seen;
    std::vector<Eigen::Matrix3d> point_h;
    std::vector<Eigen::Vector3d> point_g;
    std::vector<Block> blocks;  ///< of the nodes
    std::vector<NodeVector> g;
  };
  struct Step {
    double predicted = 0, squared_length = 0;
    std::vector<NodeVector> nodes;
    std::vector<Eigen::Vector3d> points;
  };
  /// The normal equations without the points.
  struct Reduced {
    std::vector<Block> blocks;
    std::vector<NodeVector> g;
    std::vector<Eigen::Matrix3d> inverse;        ///< of each point's own part
    std::vector<Eigen::Vector3d> point_damping;  ///< what was added to its diagonal
  };
  /// What a part of the points adds.
  struct Sums {
    std::vector<Block> blocks;
    std::vector<NodeVector> g;
    double cost = 0;
    explicit Sums(const Problem& problem)
        : blocks(static_cast<std::size_t>(problem.of.blocks_), Block::Zero()),
          g(problem.nodes(), NodeVector::Zero()) {}
  };

  std::size_t views() const { return of.state_.center.size(); }
  std::size_t nodes() const { return views() + of.state_.lens.size(); }
  std::size_t lens_node(std::size_t view) const {
    return views() + static_cast<std::size_t>(of.lens_of_[view]);
  }
  std::size_t block(std::size_t larger, std::size_t smaller) const {
    return static_cast<std::size_t>(of.block_at_[larger * nodes() + smaller]);
  }

  /// `add(first point, end, sums)` for each part, side by side; then the parts, in their order.
  template <class Add>
  Sums summed(const Add& add) const {
    const std::size_t points = of.state_.point.size(), parts = of.parts_;
    std::vector<Sums> sums(parts, Sums(*this));
    parallel_for(static_cast<int>(parts), [&](int index) {
      const auto part = static_cast<std::size_t>(index);
      add(points * part / parts, points * (part + 1) / parts, sums[part]);
    });
    for (std::size_t part = 1; part < parts; ++part) {
      for (std::size_t b = 0; b < sums[0].blocks.size(); ++b)
        sums[0].blocks[b] += sums[part].blocks[b];
      for (std::size_t n = 0; n < nodes(); ++n) sums[0].g[n] += sums[part].g[n];
      sums[0].cost += sums[part].cost;
    }
    return std::move(sums[0]);
  }

  bool linearise(const State& at, Linear& linear) const {
    std::vector<Eigen::Matrix3d> rotations;
    for (const Eigen::Quaterniond& rotation : at.rotation)
      rotations.push_back(rotation.toRotationMatrix());
    linear.seen.resize(of.seen_.size());
    linear.point_h.resize(at.point.size()), linear.point_g.resize(at.point.size());
    Sums sums = summed([&](std::size_t begin, std::size_t end, Sums& part) {
      for (std::size_t p = begin; p < end; ++p) {
        Eigen::Matrix3d& h = linear.point_h[p].setZero();
        Eigen::Vector3d& g = linear.point_g[p].setZero();
        for (std::size_t s = of.first_seen_[p]; s < of.first_seen_[p + 1]; ++s) {
          const auto v = static_cast<std::size_t>(of.seen_[s].view);
          const std::size_t l = lens_node(v);
          LinearSeen& seen = linear.seen[s];
          seen = linear_seen(rotations[v], at.center[v], at.lens[l - views()], at.point[p],
                             of.seen_[s]);
          const Cauchy loss(seen.residual.squaredNorm(), of.loss_scale_);
          part.cost += loss.cost / 2;
          seen.by_view *= loss.root, seen.by_lens *= loss.root, seen.by_point *= loss.root;
          seen.residual *= loss.root;
          h.noalias() += seen.by_point.transpose() * seen.by_point;
          g.noalias() += seen.by_point.transpose() * seen.residual;
          part.blocks[block(v, v)].noalias() += seen.by_view.transpose() * seen.by_view;
          part.blocks[block(l, v)].noalias() += seen.by_lens.transpose() * seen.by_view;
          part.blocks[block(l, l)].noalias() += seen.by_lens.transpose() * seen.by_lens;
          part.g[v].noalias() += seen.by_view.transpose() * seen.residual;
          part.g[l].noalias() += seen.by_lens.transpose() * seen.residual;
        }
      }
    });
    linear.blocks = std::move(sums.blocks), linear.g = std::move(sums.g);
    linear.cost = sums.cost;
    for (std::size_t i = 0; i < of.beliefs_.size(); ++i) {
      const std::size_t l = views() + i;
      if (all_held(of.held_[l])) continue;
      Block by_lens;
      NodeVector residual;
      linear_belief(of.beliefs_[i], at.lens[i], by_lens, residual);
      linear.blocks[block(l, l)] += by_lens.transpose() * by_lens;
      linear.g[l] += by_lens.transpose() * residual;
      linear.cost += residual.squaredNorm() / 2;
    }
    return std::isfinite(linear.cost);
  }

  /// Of a point's nodes, each once, how it hangs on the point.
  void gather(const Linear& linear, std::size_t point,
              std::vector<std::pair<std::size_t, NodeByPoint>>& hung) const {
    hung.clear();
    const auto add = [&](std::size_t node, const ByNode& by_node, const LinearSeen& seen) {
      auto at = std::find_if(hung.begin(), hung.end(),
                             [&](const auto& one) { return one.first == node; });
      if (at == hung.end()) at = hung.emplace(hung.end(), node, NodeByPoint::Zero());
      at->second.noalias() += by_node.transpose() * seen.by_point;
    };
    for (std::size_t s = of.first_seen_[point]; s < of.first_seen_[point + 1]; ++s) {
      const auto v = static_cast<std::size_t>(of.seen_[s].view);
      add(v, linear.seen[s].by_view, linear.seen[s]);
      add(lens_node(v), linear.seen[s].by_lens, linear.seen[s]);
    }
  }

  Reduced reduced(const Linear& linear, double radius) const {
    Reduced out;
    out.inverse.resize(linear.point_h.size()), out.point_damping.resize(linear.point_h.size());
    const Sums sums = summed([&](std::size_t begin, std::size_t end, Sums& part) {
      std::vector<std::pair<std::size_t, NodeByPoint>> hung;
      for (std::size_t p = begin; p < end; ++p) {
        Eigen::Matrix3d own = linear.point_h[p];
        for (Eigen::Index k = 0; k < 3; ++k) out.point_damping[p](k) = damping(own(k, k), radius);
        own.diagonal() += out.point_damping[p];
        out.inverse[p] = own.inverse();
        gather(linear, p, hung);
        for (const auto& [a, by_point] : hung) {
          const NodeByPoint gained = by_point * out.inverse[p];
          part.g[a].noalias() -= gained * linear.point_g[p];
          for (const auto& [b, other] : hung)
            if (b <= a) part.blocks[block(a, b)].noalias() -= gained * other.transpose();
        }
      }
    });
    out.blocks = linear.blocks, out.g = linear.g;
    for (std::size_t b = 0; b < out.blocks.size(); ++b) out.blocks[b] += sums.blocks[b];
    for (std::size_t n = 0; n < nodes(); ++n) out.g[n] += sums.g[n];
    return out;
  }

  bool held(std::size_t node, Eigen::Index k) const {
    return of.held_[node][static_cast<std::size_t>(k)];
  }

  /// `equations`' lower triangle times the answer is `right`; held unknowns are 0. Empty where the
  /// equations are singular, or a pivot less than that of its diagonal (not asked where sparse).
  std::vector<NodeVector> solved(const std::vector<Block>& equations,
                                 const std::vector<NodeVector>& right, double least = 0) const {
    const auto size = static_cast<Eigen::Index>(node_size * nodes());
    const auto first = [](std::size_t node) { return static_cast<Eigen::Index>(node_size * node); };
    Eigen::VectorXd b(size);
    for (std::size_t n = 0; n < nodes(); ++n)
      for (Eigen::Index k = 0; k < node_size; ++k) b(first(n) + k) = held(n, k) ? 0 : right[n](k);
    const auto each = [&](const auto& take) {
      for (std::size_t row = 0; row < nodes(); ++row)
        for (std::size_t column = 0; column <= row; ++column) {
          if (of.block_at_[row * nodes() + column] < 0) continue;
          const Block& values = equations[block(row, column)];
          for (Eigen::Index i = 0; i < node_size; ++i)
            for (Eigen::Index k = 0; k < node_size; ++k) {
              const bool lower = row != column || k <= i;
              if (lower && !held(row, i) && !held(column, k))
                take(first(row) + i, first(column) + k, values(i, k));
            }
        }
      for (std::size_t n = 0; n < nodes(); ++n)
        for (Eigen::Index k = 0; k < node_size; ++k)
          if (held(n, k)) take(first(n) + k, first(n) + k, 1.0);
    };
    Eigen::VectorXd x;
    const auto pairs = static_cast<double>(nodes() * nodes()) / 2;
    if (views() <= of.dense_up_to_ || of.blocks_ > few_pairs * pairs) {
      Eigen::MatrixXd a = Eigen::MatrixXd::Zero(size, size);
      each([&](Eigen::Index i, Eigen::Index k, double value) { a(i, k) = value; });
      const Eigen::VectorXd diagonal = a.diagonal();
      const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(a);  // reads the lower triangle
      if (factors.info() != Eigen::Success) return {};
      const Eigen::ArrayXd pivots = a.diagonal().array().square();
      if (!(pivots >= least * diagonal.array()).all()) return {};
      x = factors.solve(b);
    } else {
      std::vector<Eigen::Triplet<double>> entries;
      each(
          [&](Eigen::Index i, Eigen::Index k, double value) { entries.emplace_back(i, k, value); });
      Eigen::SparseMatrix<double> a(size, size);
      a.setFromTriplets(entries.begin(), entries.end());
      const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factors(a);
      if (factors.info() != Eigen::Success) return {};
      x = factors.solve(b);
    }
    if (!x.allFinite()) return {};
    std::vector<NodeVector> nodes_moved;
    for (std::size_t n = 0; n < nodes(); ++n) nodes_moved.push_back(x.segment<node_size>(first(n)));
    return nodes_moved;
  }

  Step step(const Linear& linear, double radius) const {
    Reduced equations = reduced(linear, radius);
    std::vector<NodeVector> damped(nodes()), right(nodes());
    for (std::size_t n = 0; n < nodes(); ++n) {
      const NodeVector diagonal = linear.blocks[block(n, n)].diagonal();
      for (Eigen::Index k = 0; k < node_size; ++k) damped[n](k) = damping(diagonal(k), radius);
      equations.blocks[block(n, n)].diagonal() += damped[n];
      right[n] = -equations.g[n];
    }
    Step found;
    found.nodes = solved(equations.blocks, right);
    if (found.nodes.empty()) return found;
    // The linear problem's gain: half of the step along the gradient, and what damping held back.
    double twice = 0;
    for (std::size_t n = 0; n < nodes(); ++n) {
      twice += -linear.g[n].dot(found.nodes[n]) + found.nodes[n].cwiseAbs2().dot(damped[n]);
      found.squared_length += found.nodes[n].squaredNorm();
    }
    found.points.resize(linear.point_h.size());
    for (std::size_t p = 0; p < found.points.size(); ++p) {
      Eigen::Vector3d pull = linear.point_g[p];
      for (std::size_t s = of.first_seen_[p]; s < of.first_seen_[p + 1]; ++s) {
        const auto v = static_cast<std::size_t>(of.seen_[s].view);
        const LinearSeen& seen = linear.seen[s];
        const Eigen::Vector2d moved =
            seen.by_view * found.nodes[v] + seen.by_lens * found.nodes[lens_node(v)];
        pull.noalias() += seen.by_point.transpose() * moved;
      }
      found.points[p] = -equations.inverse[p] * pull;
      twice += -linear.point_g[p].dot(found.points[p]) +
               found.points[p].cwiseAbs2().dot(equations.point_damping[p]);
      found.squared_length += found.points[p].squaredNorm();
    }
    found.predicted = std::isfinite(twice) ? twice / 2 : 0;
    return found;
  }

  State moved(const State& from, const Step& by) const {
    State to = from;
    for (std::size_t v = 0; v < views(); ++v) {
      const Eigen::Vector3d turn = by.nodes[v].head<3>();
      to.rotation[v] = (turned_by(turn) * to.rotation[v]).normalized();
      to.center[v] += by.nodes[v].segment<3>(3);
    }
    for (std::size_t i = 0; i < to.lens.size(); ++i)
      for (std::size_t k = 0; k < node_size; ++k)
        to.lens[i][k] += by.nodes[views() + i](static_cast<Eigen::Index>(k));
    for (std::size_t p = 0; p < to.point.size(); ++p) to.point[p] += by.points[p];
    return to;
  }

  double squared_norm(const State& at) const {
    auto sum = static_cast<double>(views());  // of unit quaternions
    for (const Eigen::Vector3d& center : at.center) sum += center.squaredNorm();
    for (const Intrinsics& lens : at.lens)
      for (const double value : lens) sum += value * value;
    for (const Eigen::Vector3d& point : at.point) sum += point.squaredNorm();
    return sum;
  }
};

TrustRegionEnd BundleSolver::solve(int max_iterations, double cost_tolerance) {
  return minimise(Problem{*this}, state_,
                  {.max_iterations = max_iterations, .cost_tolerance = cost_tolerance});
}

std::vector<std::optional<double>> BundleSolver::focal_sigmas() const {
  std::vector<std::optional<double>> sigmas(state_.lens.size());
  const Problem problem{*this};
  Problem::Linear linear;
  if (!problem.linearise(state_, linear)) return sigmas;
  constexpr double undamped = 1e16;
  const Problem::Reduced equations = problem.reduced(linear, undamped);
  std::set<int> used;
  for (const SeenPoint& seen : seen_) used.insert(lens_of_[static_cast<std::size_t>(seen.view)]);
  for (std::size_t lens = 0; lens < sigmas.size(); ++lens) {
    const std::size_t node = problem.views() + lens;
    if (!used.contains(static_cast<int>(lens)) || held_[node][0]) continue;
    std::vector<NodeVector> unit(problem.nodes(), NodeVector::Zero());
    unit[node](0) = 1;
    const std::vector<NodeVector> column = problem.solved(equations.blocks, unit, least_pivot);
    if (!column.empty() && column[node](0) > 0) sigmas[lens] = std::sqrt(column[node](0));
  }
  return sigmas;
}

}  // namespace orbitfuse
