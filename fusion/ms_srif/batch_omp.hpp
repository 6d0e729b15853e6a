// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "fusion/ms_srif/dictionary.hpp"

// Orthogonal matching pursuit on correlations alone (Rubinstein, Zibulevsky, Elad 2008, "Efficient
// implementation of the K-SVD algorithm using batch orthogonal matching pursuit", fig. 3).
namespace orbitfuse::fusion {

struct SparseCode {
  std::vector<int> atoms;
  std::vector<float> weights;
  float residual = 0;  ///< norm of what is left

  float l1() const;
};

struct OmpStop {
  int max_atoms = patch_size - 1;
  float residual = 0.8F;        ///< norm at which to stop
  float relative_residual = 0;  ///< of the signal's norm; the larger of both holds
};

/// Reusable work space of one thread.
class BatchOmp {
 public:
  explicit BatchOmp(const Dictionary& dictionary) : dictionary_(dictionary) {}
  /// `signal`: 64 samples. Stops early where an atom would depend on the chosen ones.
  void solve(const Eigen::VectorXf& signal, const OmpStop& stop, SparseCode& code);

 private:
  const Dictionary& dictionary_;
  Eigen::VectorXf correlation_;   ///< of every atom with what is left
  Eigen::MatrixXf directions_;    ///< column i: of every atom with the i-th orthonormal direction
  Eigen::VectorXf coefficients_;  ///< of the signal in those directions
  Eigen::MatrixXf cholesky_;      ///< of the chosen atoms' Gram matrix, lower
};

}  // namespace orbitfuse::fusion
