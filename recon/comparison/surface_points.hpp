// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <vector>

#include "core/geometry/kd_tree.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace orbitfuse::comparison {

/// The vertices of a mesh that have a place and a normal.
struct SurfacePoints {
  std::vector<Eigen::Vector3d> positions, normals;
  std::vector<std::size_t> index;  ///< into the mesh's vertices
  std::size_t size() const { return positions.size(); }
};

inline SurfacePoints surface_points(const TriangleMesh& mesh) {
  SurfacePoints points;
  const PointCloud& v = mesh.vertices;
  for (std::size_t i = 0; i < v.normals.size(); ++i)
    if (v.positions[i].allFinite() && v.normals[i].squaredNorm() > 0.5F) {
      points.positions.push_back(v.positions[i]);
      points.normals.push_back(v.normals[i].cast<double>());
      points.index.push_back(i);
    }
  return points;
}

/// Of the points' box; 0 of none.
inline double diagonal(const SurfacePoints& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points.positions) box.extend(p);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

/// From a point to the surface that vertices sample: to the plane of a near vertex, while the
/// point lies over it no farther than vertices are apart; else to the vertex itself.
inline double distance_to(const SurfacePoints& surface, const KdTree& tree,
                          const Eigen::Vector3d& x) {
  constexpr std::size_t count = 6;
  std::size_t near[count];
  double d2[count];
  const std::size_t found = tree.nearest(x, count, near, d2);
  if (found == 0) return std::numeric_limits<double>::infinity();
  // How far vertices are apart round here.
  const double apart = (surface.positions[near[0]] - surface.positions[near[found - 1]]).norm();
  double least = std::sqrt(d2[0]);
  for (std::size_t k = 0; k < std::min<std::size_t>(found, 3); ++k) {
    const Eigen::Vector3d offset = x - surface.positions[near[k]];
    const double height = std::abs(surface.normals[near[k]].dot(offset));
    if (d2[k] - height * height <= apart * apart) least = std::min(least, height);
  }
  return least;
}

}  // namespace orbitfuse::comparison
