// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/level_plane.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/numeric/random.hpp"

namespace orbitfuse {
namespace {

constexpr std::uint64_t stream = 71;
constexpr std::size_t least_points = 100;
constexpr int fits = 3;

std::optional<LevelPlane> level_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& point,
                                      const Eigen::Vector3d& up, double max_tilt_deg) {
  LevelPlane plane;
  plane.normal = normal.dot(up) < 0 ? -normal : normal;
  plane.height = plane.normal.dot(point);
  if (!(plane.normal.dot(up) > std::cos(max_tilt_deg * std::numbers::pi / 180)))
    return std::nullopt;
  return plane;
}

std::optional<LevelPlane> fitted(const std::vector<Eigen::Vector3d>& points,
                                 const Eigen::Vector3d& up, double max_tilt_deg) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) middle += p;
  middle /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - middle) * (p - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  return level_plane(axes.eigenvectors().col(0), middle, up, max_tilt_deg);
}

/// Trials after which a plane of more points would have been met, but for one case in ten thousand.
int trials_for(std::ptrdiff_t most, std::size_t count) {
  const double share = static_cast<double>(most) / static_cast<double>(count);
  const double all_three = share * share * share;
  if (all_three >= 1) return 1;
  const double needed = std::log(1e-4) / std::log1p(-all_three);
  return needed < 1e6 ? static_cast<int>(needed) + 1 : 1'000'000;
}

}  // namespace

std::vector<Eigen::Vector3d> in_plane(const std::vector<Eigen::Vector3d>& points,
                                      const LevelPlane& plane, double band) {
  std::vector<Eigen::Vector3d> near;
  for (const Eigen::Vector3d& p : points)
    if (std::abs(plane.above(p)) <= band) near.push_back(p);
  return near;
}

std::optional<LevelPlane> largest_level_plane(const std::vector<Eigen::Vector3d>& points,
                                              const Eigen::Vector3d& up,
                                              const LevelPlaneSearch& search) {
  if (points.size() < least_points) return std::nullopt;
  std::optional<LevelPlane> best;
  std::ptrdiff_t most = 0;
  for (int trial = 0; trial < std::min(search.trials, trials_for(most, points.size())); ++trial) {
    const auto draw = [&](int k) {
      return points[random_bits(search.seed, stream, static_cast<std::uint64_t>(3 * trial + k)) %
                    points.size()];
    };
    const Eigen::Vector3d a = draw(0), b = draw(1), c = draw(2);
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > search.band * search.band)) continue;
    const auto plane = level_plane(normal.normalized(), a, up, search.max_tilt_deg);
    if (!plane || (search.admissible && !search.admissible(*plane))) continue;
    const auto count = std::count_if(points.begin(), points.end(), [&](const auto& p) {
      return std::abs(plane->above(p)) <= search.band;
    });
    if (count > most) most = count, best = plane;
  }
  for (int i = 0; i < fits && best; ++i) {
    const auto near = in_plane(points, *best, search.band);
    if (near.size() < least_points) return std::nullopt;
    best = fitted(near, up, search.max_tilt_deg);
  }
  return best;
}

}  // namespace orbitfuse
