// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/scene_ball.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/nearest_to_lines.hpp"

namespace orbitfuse {

SceneBall scene_ball(const std::vector<Rigid3d>& cam_from_world,
                     std::vector<Eigen::Vector3d> points) {
  const double n = static_cast<double>(cam_from_world.size());
  NearestToLines axes;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), forward = mean;
  for (const Rigid3d& pose : cam_from_world) {
    const Eigen::Vector3d c = camera_center(pose),
                          axis = pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    axes.add(c, axis);
    mean += c / n;
    forward += axis;
  }
  SceneBall ball;
  if (axes.crossing() > 1e-3) {
    ball.center = axes.point();
  } else if (!points.empty()) {
    const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
    for (int i = 0; i < 3; ++i) {
      std::nth_element(points.begin(), middle, points.end(),
                       [i](const auto& p, const auto& q) { return p[i] < q[i]; });
      ball.center[i] = (*middle)[i];
    }
  } else {
    double spread = 0;
    for (const Rigid3d& pose : cam_from_world)
      spread = std::max(spread, (camera_center(pose) - mean).norm());
    ball.center = mean + forward.normalized() * (spread > 0 ? 2 * spread : 1.0);
  }
  double distance = 0;
  for (const Rigid3d& pose : cam_from_world)
    distance += (camera_center(pose) - ball.center).norm() / n;
  ball.radius = std::isfinite(distance) && distance > 0 ? distance : 1.0;
  return ball;
}

double rms_radius(const std::vector<Eigen::Vector3d>& places) {
  if (places.empty()) return 0;
  const auto count = static_cast<double>(places.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place : places) middle += place;
  middle /= count;
  double squares = 0;
  for (const Eigen::Vector3d& place : places) squares += (place - middle).squaredNorm();
  return std::sqrt(squares / count);
}

}  // namespace orbitfuse
