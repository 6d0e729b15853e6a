// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/geometry/triangle_mesh.hpp"
#include "recon/surface/distance_grid.hpp"

namespace orbitfuse {

/// The zero level of the grid: a vertex in each cell whose corners have both signs, at the mean of
/// where its edges cross zero; two triangles round each edge that crosses. Cells with a corner of
/// less than `least_weight` have none, nor has what lies outside the box.
TriangleMesh surface_net(const DistanceGrid& grid, float least_weight,
                         const Eigen::AlignedBox3d& box);

}  // namespace orbitfuse
