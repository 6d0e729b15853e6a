// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/ambiguity.hpp"

#include <Eigen/Eigenvalues>
#include <vector>

namespace orbitfuse::registration {
namespace {

/// Mean square normal displacement per unit of motion of a cloud of radius 1. Noise in the normals
/// alone gives a sphere 0.001; the flattest direction of real objects is above 0.01.
constexpr double open_eigenvalue = 0.004;

const char* name_of(const Vector7& direction) {
  const double turn = direction.head<3>().squaredNorm(), grow = direction[3] * direction[3];
  const double shift = direction.tail<3>().squaredNorm();
  if (turn >= grow && turn >= shift) return "rotation about an axis";
  return grow >= shift ? "size" : "a shift along the surface";
}

}  // namespace

std::string open_directions(const Matrix7& hessian) {
  const Eigen::SelfAdjointEigenSolver<Matrix7> solver(hessian);
  std::string words;
  for (int i = 0; i < 7; ++i) {
    if (solver.eigenvalues()[i] >= open_eigenvalue) break;
    const std::string name = name_of(solver.eigenvectors().col(i));
    if (words.find(name) == std::string::npos) words += (words.empty() ? "" : ", ") + name;
  }
  return words;
}

}  // namespace orbitfuse::registration
