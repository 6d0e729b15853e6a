// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"

namespace orbitfuse {

/// A connected part of a mesh whose vertices carry one label.
struct MeshRegion {
  int label = 0;
  std::vector<std::uint32_t> vertices;
  double area = 0;  ///< a third of each triangle for each of its vertices, squared unit
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of its vertices, weighted by area
};

/// Area that belongs to each vertex; triangles with a corner that is not finite have none.
std::vector<double> vertex_areas(const TriangleMesh& mesh);

/// Regions of labels other than 0, the largest area first. `labels`: one a vertex.
std::vector<MeshRegion> connected_regions(const TriangleMesh& mesh, const std::vector<int>& labels);

}  // namespace orbitfuse
