// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/point_cloud.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// ASCII or binary PLY vertices: x y z (any unit), nx ny nz, red green blue, temperature (kelvin).
/// Other properties and elements are skipped. Positions that are not finite, or beyond 1e9, are
/// kept as NaN (callers decide). Errors: input (no file, not PLY, cut off, no vertices), which name
/// the file.
Result<PointCloud> read_ply(const std::filesystem::path& path);

/// Binary little-endian, positions as doubles; attributes that the cloud has. Errors: device.
Status write_ply(const std::filesystem::path& path, const PointCloud& cloud);

struct PlyWriteOptions {
  /// Of the temperatures in kelvin: what other tools take for a scalar is called "scalar_..." by
  /// CloudCompare and "quality" by MeshLab.
  std::string temperature_name = "temperature";
  std::vector<std::string> comments;       ///< lines of the header: frame, unit
  std::vector<VertexScalar> scalars = {};  ///< after the temperatures
};

/// Vertices and faces (vertex_indices), binary little-endian; without triangles a cloud. Errors:
/// input (a name or comment that would break the header, scalars that are not one a vertex),
/// device.
Status write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
                 const PlyWriteOptions& options);

}  // namespace orbitfuse
