// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace orbitfuse {

/// Positions with optional attributes: an attribute vector is empty or as long as positions.
struct PointCloud {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3f> normals;             ///< unit length
  std::vector<std::array<std::uint8_t, 3>> colors;  ///< R, G, B
  std::vector<float> temperatures_k;                ///< NaN = unknown

  std::size_t size() const { return positions.size(); }
  bool empty() const { return positions.empty(); }
};

}  // namespace orbitfuse
