// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace orbitfuse {

/// normal . x = height; the normal is of unit length and points up.
struct LevelPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double height = 0;

  double above(const Eigen::Vector3d& point) const { return normal.dot(point) - height; }
};

struct LevelPlaneSearch {
  double max_tilt_deg = 15;  ///< between its normal and up
  double band = 0.01;        ///< what counts as in the plane, to either side, in the points' unit
  int trials = 300;          ///< at most; fewer where a large plane was met
  std::uint64_t seed = 1;
  /// Which planes may be tried; empty: all.
  std::function<bool(const LevelPlane&)> admissible = {};
};

/// The plane that most of the points lie in (RANSAC, Fischler and Bolles 1981), fitted to these.
/// None where fewer than 100 lie in it or it tilts more than asked.
std::optional<LevelPlane> largest_level_plane(const std::vector<Eigen::Vector3d>& points,
                                              const Eigen::Vector3d& up,
                                              const LevelPlaneSearch& search);

/// The points that lie within `band` of it.
std::vector<Eigen::Vector3d> in_plane(const std::vector<Eigen::Vector3d>& points,
                                      const LevelPlane& plane, double band);

}  // namespace orbitfuse
