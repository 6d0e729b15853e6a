// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/point_cloud.hpp"

namespace orbitfuse {

/// A surface: triangles of indices into vertices, counter-clockwise seen from outside.
struct TriangleMesh {
  PointCloud vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  bool empty() const { return triangles.empty(); }
};

/// A further number at each vertex, for the writers of files.
struct VertexScalar {
  std::string name;           ///< one word
  std::vector<float> values;  ///< one a vertex
};

}  // namespace orbitfuse
