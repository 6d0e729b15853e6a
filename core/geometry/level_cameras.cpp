// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/level_cameras.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/nearest_to_lines.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {

/// Axes less round than this say nothing of what is across them.
constexpr double least_round = 0.02;

Eigen::Vector3d axis_in_world(const Rigid3d& cam_from_world, const Eigen::Vector3d& axis_in_cam) {
  return cam_from_world.rotation.conjugate() * axis_in_cam;
}

/// Where one axis of each camera points.
struct AxesSpread {
  AxesSpread(const std::vector<Rigid3d>& cameras, const Eigen::Vector3d& axis_in_cam) {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Rigid3d& camera : cameras) {
      const Eigen::Vector3d axis = axis_in_world(camera, axis_in_cam);
      spread += axis * axis.transpose() / static_cast<double>(cameras.size());
      sum += axis;
    }
    solver.compute(spread);
  }
  /// 0 of axes along one line, 1/2 of those all round in a plane.
  double round() const { return solver.eigenvalues()(1); }
  /// What is the most across them all.
  Eigen::Vector3d least() const { return solver.eigenvectors().col(0); }

  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
};

/// Of upright cameras the y axes fan out with the elevation: by .21 from the ground to the zenith.
/// More, and twice as much as the x axes, is a walk of 125 degrees and more on the side; a shorter
/// one can't be told from a climb.
bool on_side(const AxesSpread& right, const AxesSpread& down) {
  return down.round() > 2 * right.round() && down.round() > 0.3;
}

}  // namespace

std::vector<Rigid3d> cameras_of(const std::vector<PosedView>& views) {
  std::vector<Rigid3d> cameras;
  for (const PosedView& view : views) cameras.push_back(view.cam_from_world);
  return cameras;
}

Eigen::Vector3d look_at_point(const std::vector<Rigid3d>& cameras) {
  Eigen::Vector3d point = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  std::vector<double> weight(cameras.size(), 1.0);
  for (int pass = 0; pass < 10; ++pass) {
    NearestToLines axes;
    for (std::size_t i = 0; i < cameras.size(); ++i)
      axes.add(camera_center(cameras[i]), axis_in_world(cameras[i], Eigen::Vector3d::UnitZ()),
               weight[i]);
    if (!(axes.crossing() > 1e-6)) return point;
    point = axes.point();
    std::vector<double> distance(cameras.size());
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const Eigen::Vector3d d = axis_in_world(cameras[i], Eigen::Vector3d::UnitZ());
      const Eigen::Vector3d v = point - camera_center(cameras[i]);
      distance[i] = (v - d * d.dot(v)).norm();
    }
    const double scale = std::max(median(distance), 1e-12);
    for (std::size_t i = 0; i < cameras.size(); ++i)
      weight[i] = 1.0 / std::max(1.0, distance[i] / scale);  // Huber
  }
  return point;
}

bool held_on_side(const std::vector<Rigid3d>& cameras) {
  return on_side({cameras, Eigen::Vector3d::UnitX()}, {cameras, Eigen::Vector3d::UnitY()});
}

Eigen::Vector3d up_direction(const std::vector<Rigid3d>& cameras) {
  const AxesSpread right(cameras, Eigen::Vector3d::UnitX());
  const AxesSpread down(cameras, Eigen::Vector3d::UnitY());
  const bool side = on_side(right, down);
  Eigen::Vector3d mean_up = -down.sum;
  if (side) {  // to the left or to the right: cameras look down rather than up
    const Eigen::Vector3d origin = look_at_point(cameras);
    mean_up.setZero();
    for (const Rigid3d& camera : cameras) mean_up += camera_center(camera) - origin;
  }
  if (!side && right.round() < least_round) return mean_up.normalized();
  const Eigen::Vector3d up = (side ? down : right).least();
  return up.dot(mean_up) < 0 ? Eigen::Vector3d(-up) : up;
}

double share_not_upright(const std::vector<Rigid3d>& cameras, const Eigen::Vector3d& up) {
  constexpr double straight_down = 0.97;
  double asked = 0, not_upright = 0;
  for (const Rigid3d& camera : cameras) {
    const Eigen::Vector3d in_cam = camera.rotation * up;
    if (!(std::abs(in_cam.z()) < straight_down)) continue;
    ++asked;
    not_upright += in_cam.y() < -std::abs(in_cam.x()) ? 0 : 1;
  }
  return asked > 0 ? not_upright / asked : 0;
}

}  // namespace orbitfuse
