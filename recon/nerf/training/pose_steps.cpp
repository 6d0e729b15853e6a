// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/pose_steps.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace orbitfuse::nerf {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr int reach_px =
    2;  ///< slopes are taken over twice this: errors of that size still pull home
constexpr double huber =
    0.05;  ///< of the span; what the scene hides or reflects doesn't count for more
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
  const cv::Mat& photo = view.target;
  if (x < reach_px || y < reach_px || x >= photo.cols - reach_px || y >= photo.rows - reach_px)
    return;
  const Camera& camera = view.rays.camera();
  const Eigen::Vector3d p = view.rays.in_camera(x + 0.5, y + 0.5, distance);
  if (!(p.z() > 1e-6)) return;
  // The lens bends motion little; what it does to the slope of a step, the next step makes good.
  Eigen::Matrix<double, 2, 3> projection;
  projection << camera.fx / p.z(), 0, -camera.fx * p.x() / (p.z() * p.z()),  //
      0, camera.fy / p.z(), -camera.fy * p.y() / (p.z() * p.z());
  Eigen::Matrix3d cross;
  cross << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  Eigen::Matrix<double, 2, 6> motion;
  motion << projection, -projection * cross;
  Eigen::Map<Matrix6> normal(sums.normal.data());
  Eigen::Map<Vector6> right(sums.right.data());
  const int channels = photo.channels();
  const auto at = [&](int dx, int dy, int c) -> double {
    return photo.ptr<float>(y + dy)[(x + dx) * channels + c];
  };
  bool said = false;
  for (int c = 0; c < channels; ++c) {
    const Eigen::RowVector2d slope((at(reach_px, 0, c) - at(-reach_px, 0, c)) / (2 * reach_px),
                                   (at(0, reach_px, c) - at(0, -reach_px, c)) / (2 * reach_px));
    const double error = shown[c] - at(0, 0, c);
    if (!slope.allFinite() || !std::isfinite(error)) continue;
    const double weight = std::min(1.0, huber / std::max(1e-12, std::abs(error)));
    const Vector6 row = (slope * motion).transpose();
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
