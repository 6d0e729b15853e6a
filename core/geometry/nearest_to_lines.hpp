// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>

namespace orbitfuse {

/// The point with the least (weighted) sum of squared distances to lines: the normal equations
/// sum w (I - d d^T) (p - c) = 0 of lines through c along d.
class NearestToLines {
 public:
  /// `direction` of length 1.
  void add(const Eigen::Vector3d& center, const Eigen::Vector3d& direction, double weight = 1) {
    const Eigen::Matrix3d across =
        weight * (Eigen::Matrix3d::Identity() - direction * direction.transpose());
    a_ += across;
    b_ += across * center;
    weight_ += weight;
  }
  /// How well the lines cross, 0 (parallel, or none) to 1/3 and a little more: the least eigenvalue
  /// of the equations over the weight of all lines.
  double crossing() const {
    if (!(weight_ > 0)) return 0;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a_, Eigen::EigenvaluesOnly);
    return solver.eigenvalues()[0] / weight_;
  }
  /// Anything, also not finite, where crossing() is 0.
  Eigen::Vector3d point() const { return a_.ldlt().solve(b_); }

 private:
  Eigen::Matrix3d a_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b_ = Eigen::Vector3d::Zero();
  double weight_ = 0;
};

}  // namespace orbitfuse
