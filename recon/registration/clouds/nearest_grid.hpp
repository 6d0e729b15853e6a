// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace orbitfuse::registration {

/// Nearest point by table: a cube of cells round the cloud, each with the index of the point that
/// is nearest to its centre (vector distance transform, Danielsson 1980). One load a query; exact
/// to a cell's diagonal; nothing outside. At most 65535 points.
class NearestGrid {
 public:
  void build(const std::vector<Eigen::Vector3d>& points, int cells_per_side, double margin);

  std::optional<std::size_t> lookup(const Eigen::Vector3d& x) const {
    const Eigen::Array3i c = ((x - origin_) * inverse_cell_).array().floor().cast<int>();
    if ((c < 0).any() || (c >= side_).any()) return std::nullopt;
    return index_[static_cast<std::size_t>((c.z() * side_ + c.y()) * side_ + c.x())];
  }
  double cell() const { return 1.0 / inverse_cell_; }

 private:
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  double inverse_cell_ = 1;
  int side_ = 0;
  std::vector<std::uint16_t> index_;  ///< 16 bits: both clouds' tables stay in the L2 cache
};

}  // namespace orbitfuse::registration
