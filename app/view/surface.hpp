// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/geometry/triangle_mesh.hpp"

namespace orbitfuse::view {

/// One cloud with colours and temperatures from one with colours and one with temperatures, both in
/// one frame: each coloured point takes the temperature of the nearest thermal point, NaN where
/// none is near (three times the thermal points' median spacing). One empty: the other as it is.
/// At most what a phone draws at 30 pictures a second, in an order in which the first n points are
/// spread over the whole, for any n. Points that are not finite are left out.
PointCloud surface_of(const PointCloud& visible, PointCloud thermal);

/// For the browser, little-endian: uint32 count, float32 low[3], float32 step[3] (position = low +
/// step * integer), then uint16 positions[3 * count], uint8 colours[3 * count] (128 where there are
/// none), padding to an even offset, uint16 temperatures[count] (counts of
/// `kelvin_per_count`, 0 = none).
std::string packed(const PointCloud& surface, double kelvin_per_count);

/// Likewise: uint32 triangle count, float32 kelvin_per_count, the vertices as above, padding to a
/// multiple of four, uint32 corners[3 * triangles].
std::string packed(const TriangleMesh& mesh);

}  // namespace orbitfuse::view
