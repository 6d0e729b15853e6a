// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/point_cloud.hpp"

namespace orbitfuse {

/// A surface: triangles of indices into vertices, counter-clockwise seen from outside.
struct TriangleMesh {
  PointCloud vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  bool empty() const { return triangles.empty(); }
};

}  // namespace orbitfuse
