// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/geometry/point_cloud.hpp"
#include "core/geometry/transform.hpp"

// Synthetic registration pairs: one surface, sampled twice, damaged, and moved by a known
// similarity. Lengths of the damage are relative to the surface's diameter (of the bounding box).
namespace orbitfuse::scenes {

using Positions = std::vector<Eigen::Vector3d>;

/// Triangles, sampled evenly by area.
class Surface {
 public:
  void triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);
  void quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& d);
  void box(const Eigen::Vector3d& low, const Eigen::Vector3d& high);
  void cylinder(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius);
  Positions sample(int count, std::mt19937& random) const;
  double diameter() const;  ///< of the bounding box
  double radius() const;    ///< largest distance of a vertex from the centre of the area
  bool empty() const { return triangles_.empty(); }

 private:
  std::vector<std::array<Eigen::Vector3d, 3>> triangles_;
  std::vector<double> area_until_;
};

/// "bunny" (from the shared data; nothing when absent), "indoor", "car".
std::optional<Surface> surface(const std::string& name);

struct Level {
  std::string name;
  int source_points = 3000, target_points = 3000;
  double noise = 0;     ///< standard deviation, of the diameter
  double overlap = 1;   ///< share of each cloud that the other has: cut from opposite ends
  double outliers = 0;  ///< share of all points, uniform in the 1.2-fold bounding box
  double holes = 0;     ///< share of the source's surface taken out in balls
  double floaters = 0;  ///< share of the source's points in small clusters off the surface
  double warp = 0;      ///< amplitude of a smooth deformation of the source, of the diameter
  bool bars = true;     ///< has a bar in the suite
  double success_bar = 1;
};
const std::vector<Level>& levels();

struct CloudPair {
  PointCloud source, target;
  Similarity3d target_from_source;
  double diameter = 1;  ///< of the target's surface, target units
  /// Where each source point truly lies, damage undone, target frame; NaN for points off any
  /// surface (floaters, outliers).
  Positions source_truth;
  Positions check;  ///< undamaged surface points in the source frame
};
CloudPair make_pair(const Surface& surface, const Level& level, std::uint32_t seed);

/// Root mean square distance between where truth and estimate put the surface, % of the diameter.
double surface_rmse_percent(const CloudPair& pair, const Similarity3d& estimate);

}  // namespace orbitfuse::scenes
