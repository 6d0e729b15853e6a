// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/ms_srif/batch_omp.hpp"

#include <algorithm>
#include <cmath>

namespace orbitfuse::fusion {

float SparseCode::l1() const {
  float sum = 0;
  for (const float w : weights) sum += std::abs(w);
  return sum;
}

void BatchOmp::solve(const Eigen::VectorXf& signal, const OmpStop& stop, SparseCode& code) {
  code.atoms.clear();
  code.weights.clear();
  const float energy = signal.squaredNorm();
  const float bound = std::max(stop.residual * stop.residual, stop.relative_residual * stop.relative_residual * energy);
  code.residual = std::sqrt(energy);
  if (energy <= bound) return;

  const int limit = std::min({stop.max_atoms, dictionary_.size(), patch_size});
  if (cholesky_.rows() < limit) cholesky_.resize(limit, limit);
  const Eigen::MatrixXf& gram = dictionary_.gram();
  initial_.noalias() = dictionary_.atoms().transpose() * signal;
  correlation_ = initial_;
  for (int n = 0; n < limit; ++n) {
    Eigen::Index atom = 0;
    if (!(correlation_.cwiseAbs().maxCoeff(&atom) > 0)) break;
    if (std::find(code.atoms.begin(), code.atoms.end(), static_cast<int>(atom)) != code.atoms.end()) break;
    // Next row of the Cholesky factor.
    column_.resize(n);
    for (int i = 0; i < n; ++i) column_[i] = gram(code.atoms[static_cast<std::size_t>(i)], atom);
    const auto factor = cholesky_.topLeftCorner(n, n).triangularView<Eigen::Lower>();
    if (n > 0) factor.solveInPlace(column_);
    const float pivot = 1 - column_.squaredNorm();
    if (pivot < 1e-6F) break;
    cholesky_.row(n).head(n) = column_.transpose();
    cholesky_(n, n) = std::sqrt(pivot);
    code.atoms.push_back(static_cast<int>(atom));

    solution_.resize(n + 1);
    for (int i = 0; i <= n; ++i) solution_[i] = initial_[code.atoms[static_cast<std::size_t>(i)]];
    const auto grown = cholesky_.topLeftCorner(n + 1, n + 1).triangularView<Eigen::Lower>();
    grown.solveInPlace(solution_);
    const float explained = solution_.squaredNorm();  // of the signal's projection on the atoms
    grown.transpose().solveInPlace(solution_);
    code.weights.assign(solution_.data(), solution_.data() + n + 1);
    const float left = std::max(0.0F, energy - explained);
    code.residual = std::sqrt(left);
    if (left <= bound || n + 1 == limit) break;
    correlation_ = initial_;
    for (int i = 0; i <= n; ++i)
      correlation_.noalias() -= solution_[i] * gram.col(code.atoms[static_cast<std::size_t>(i)]);
  }
}

}  // namespace orbitfuse::fusion
