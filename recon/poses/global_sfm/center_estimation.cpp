// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/global_sfm/center_estimation.hpp"

#include <ceres/ceres.h>

namespace orbitfuse {
namespace {

struct DirectionResidual {
  Eigen::Vector3d first_from_second;  ///< unit, in the world
  double sigma;

  template <class T>
  bool operator()(const T* first, const T* second, T* residual) const {
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> a(first), b(second);
    const Eigen::Matrix<T, 3, 1> apart = a - b;
    const T length = ceres::sqrt(apart.squaredNorm() + T(1e-12));
    for (int i = 0; i < 3; ++i)
      residual[i] = (apart(i) / length - T(first_from_second(i))) / T(sigma);
    return true;
  }
};

struct OrbitResidual {
  Eigen::Vector3d nominal;
  double sigma;

  template <class T>
  bool operator()(const T* center, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = (center[i] - T(nominal(i))) / T(sigma);
    return true;
  }
};

}  // namespace

std::vector<Eigen::Vector3d> estimate_centers(const std::vector<Eigen::Quaterniond>& cam_from_world,
                                              const std::vector<RelativePose>& pairs,
                                              const CenterOptions& options) {
  std::vector<Eigen::Vector3d> centers;
  for (const Eigen::Quaterniond& rotation : cam_from_world)
    centers.push_back(rotation.conjugate() * -Eigen::Vector3d::UnitZ());
  ceres::Problem problem;
  for (Eigen::Vector3d& center : centers)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<OrbitResidual, 3, 3>(
                                 new OrbitResidual{center, options.orbit_sigma}),
                             nullptr, center.data());
  for (const RelativePose& pair : pairs) {
    const auto i = static_cast<std::size_t>(pair.first), j = static_cast<std::size_t>(pair.second);
    const Eigen::Vector3d direction =
        cam_from_world[j].conjugate() * pair.second_from_first.translation;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<DirectionResidual, 3, 3, 3>(
            new DirectionResidual{direction.normalized(), options.direction_sigma}),
        new ceres::CauchyLoss(1.0), centers[i].data(), centers[j].data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  if (centers.size() > 100) solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.num_threads = 1;
  solver.max_num_iterations = 100;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return centers;
}

}  // namespace orbitfuse
