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
  const float bound = std::max(stop.residual * stop.residual,
                               stop.relative_residual * stop.relative_residual * energy);
  code.residual = std::sqrt(energy);
  if (energy <= bound) return;

  const int limit = std::min({stop.max_atoms, dictionary_.size(), patch_size});
  if (limit <= 0) return;
  if (directions_.cols() < limit) {
    directions_.resize(dictionary_.size(), limit);
    cholesky_.resize(limit, limit);
    coefficients_.resize(limit);
  }
  correlation_.noalias() = dictionary_.atoms().transpose() * signal;
  float explained = 0;
  int chosen = 0;
  while (chosen < limit) {
    const float largest = correlation_.cwiseAbs().maxCoeff();
    if (!(largest > 0)) break;
    int atom = 0;
    while (std::abs(correlation_[atom]) != largest) ++atom;
    if (std::find(code.atoms.begin(), code.atoms.end(), atom) != code.atoms.end()) break;
    // What direction i has in common with the atom is the next row of the Cholesky factor: no
    // triangular system is solved until the last atom is known.
    const auto row = directions_.row(atom).head(chosen);
    const float pivot = 1 - row.squaredNorm();
    if (pivot < 1e-6F) break;
    cholesky_.row(chosen).head(chosen) = row;
    const float length = std::sqrt(pivot);
    cholesky_(chosen, chosen) = length;
    auto direction = directions_.col(chosen);
    direction = dictionary_.gram().col(atom);
    for (int i = 0; i < chosen; ++i) direction -= cholesky_(chosen, i) * directions_.col(i);
    direction /= length;
    const float coefficient = correlation_[atom] / length;
    correlation_ -= coefficient * direction;
    coefficients_[chosen] = coefficient;
    explained += coefficient * coefficient;
    code.atoms.push_back(atom);
    ++chosen;
    if (energy - explained <= bound) break;
  }
  auto weights = coefficients_.head(chosen);
  cholesky_.topLeftCorner(chosen, chosen)
      .triangularView<Eigen::Lower>()
      .transpose()
      .solveInPlace(weights);
  code.weights.assign(weights.data(), weights.data() + chosen);
  code.residual = std::sqrt(std::max(0.0F, energy - explained));
}

}  // namespace orbitfuse::fusion
