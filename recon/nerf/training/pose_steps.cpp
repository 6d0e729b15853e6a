// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/pose_steps.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "recon/nerf/field/pose_row.hpp"

namespace orbitfuse::nerf {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double rate = 0.7;  ///< of a step: its rays are few
constexpr double longest_turn = std::numbers::pi / 180, longest_shift = 0.02;

}  // namespace

void PoseSums::add(const PoseSums& other) {
  for (std::size_t i = 0; i < normal.size(); ++i) normal[i] += other.normal[i];
  for (std::size_t i = 0; i < right.size(); ++i) right[i] += other.right[i];
  rays += other.rays;
}

void add_ray(const NormalisedView& view, int x, int y, const float* shown, float distance,
             PoseSums& sums) {
  constexpr int reach_px = slope_reach_px;
  const cv::Mat& photo = view.target;
  if (x < reach_px || y < reach_px || x >= photo.cols - reach_px || y >= photo.rows - reach_px)
    return;
  const Camera& camera = view.rays.camera();
  const Eigen::Vector3d p = view.rays.in_camera(x + 0.5, y + 0.5, distance);
  if (!(p.z() > 1e-6)) return;
  Eigen::Map<Matrix6> normal(sums.normal.data());
  Eigen::Map<Vector6> right(sums.right.data());
  const int channels = photo.channels();
  const auto at = [&](int dx, int dy, int c) -> double {
    return photo.ptr<float>(y + dy)[(x + dx) * channels + c];
  };
  bool said = false;
  for (int c = 0; c < channels; ++c) {
    const double slope_x = (at(reach_px, 0, c) - at(-reach_px, 0, c)) / (2 * reach_px),
                 slope_y = (at(0, reach_px, c) - at(0, -reach_px, c)) / (2 * reach_px);
    const double error = shown[c] - at(0, 0, c);
    if (!std::isfinite(slope_x) || !std::isfinite(slope_y) || !std::isfinite(error)) continue;
    const double weight = pose_weight(error);
    Vector6 row;
    pose_row(camera.fx, camera.fy, p.data(), slope_x, slope_y, row.data());
    said = true;
    normal += weight * row * row.transpose();
    right += weight * error * row;
  }
  sums.rays += said ? 1 : 0;
}

Rigid3d RefinedPose::pose() const {
  const auto& c = cam_from_world;
  return {Eigen::Quaterniond(c[3], c[0], c[1], c[2]), {c[4], c[5], c[6]}};
}

RefinedPose unmoved(const Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {{q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()}, {}, {}};
}

bool take_step(const PoseSums& sums, const Space& space, RefinedPose& refined, NormalisedView& view,
               const PosePrior& prior) {
  if (sums.rays < fewest_pose_rays) return false;
  const auto information = [&](double sigma) {
    return Eigen::Vector3d::Constant(prior.noise * prior.noise / (sigma * sigma));
  };
  Vector6 given;
  given << information(prior.sigma_shift), information(prior.sigma_turn_rad);
  Eigen::Map<Vector6> moved(refined.moved.data());
  const Eigen::Map<const Vector6> right(sums.right.data());
  const double share =
      fewest_pose_rays /
      static_cast<double>(sums.rays);  // more rays aren't more sure of what is alike in all
  Matrix6 normal = share * Eigen::Map<const Matrix6>(sums.normal.data());
  normal.diagonal() += given;
  Vector6 step = rate * normal.ldlt().solve(share * right - given.cwiseProduct(moved));
  if (!step.allFinite()) return false;
  step /=
      std::max({1.0, step.head<3>().norm() / longest_shift, step.tail<3>().norm() / longest_turn});
  moved += step;
  refined.cam_from_world =
      unmoved(view.rays.moved(step.head<3>(), step.tail<3>(), space)).cam_from_world;
  view.rays.place(refined.pose(), space);  // as a resumed training does from its checkpoint
  return true;
}

}  // namespace orbitfuse::nerf
