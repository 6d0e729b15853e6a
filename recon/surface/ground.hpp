// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "core/geometry/level_plane.hpp"
#include "core/geometry/triangle_mesh.hpp"

// What an object stands on, to leave it out of its surface. An object that hangs free, or stands on
// something that ends within the box (a turntable, a plinth), has none.
namespace orbitfuse {

struct GroundPlane : LevelPlane {
  double sigma = 0;  ///< how far the ground's own points lie off it, robust
};

/// The plane of most of the mesh's upward triangles, within 15 degrees of level, if it goes on to
/// the box's sides all round and next to nothing lies below it.
std::optional<GroundPlane> find_ground(const TriangleMesh& mesh, const Eigen::AlignedBox3d& box,
                                       const Eigen::Vector3d& up);

/// Without the triangles of which no corner is `clearance` or more above the plane.
TriangleMesh without_ground(const TriangleMesh& mesh, const GroundPlane& ground, double clearance);

}  // namespace orbitfuse
