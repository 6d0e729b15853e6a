// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/nearest_grid.hpp"

#include <limits>

namespace orbitfuse::registration {

void NearestGrid::build(const std::vector<Eigen::Vector3d>& points, int cells_per_side,
                        double margin) {
  Eigen::Vector3d low = points[0], high = points[0];
  for (const auto& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double extent = (high - low).maxCoeff() + 2 * margin;
  origin_ = 0.5 * (low + high) - Eigen::Vector3d::Constant(0.5 * extent);
  side_ = cells_per_side;
  inverse_cell_ = side_ / extent;
  const auto n = static_cast<std::size_t>(side_);
  constexpr std::uint16_t no_point = 0xFFFF;
  index_.assign(n * n * n, no_point);
  std::vector<float> best(index_.size(), std::numeric_limits<float>::infinity());
  std::vector<Eigen::Vector3f> cell_points;
  cell_points.reserve(points.size());
  for (const auto& p : points) cell_points.push_back(((p - origin_) * inverse_cell_).cast<float>());

  const auto offer = [&](int x, int y, int z, std::uint16_t candidate) {
    if (candidate == no_point) return;
    const auto at = static_cast<std::size_t>((z * side_ + y) * side_ + x);
    const Eigen::Vector3f& p = cell_points[candidate];
    const float dx = p.x() - (static_cast<float>(x) + 0.5f),
                dy = p.y() - (static_cast<float>(y) + 0.5f),
                dz = p.z() - (static_cast<float>(z) + 0.5f);
    const float d = dx * dx + dy * dy + dz * dz;
    if (d < best[at]) {
      best[at] = d;
      index_[at] = candidate;
    }
  };
  for (std::size_t i = 0; i < cell_points.size(); ++i) {
    const Eigen::Vector3i c = cell_points[i].array().floor().cast<int>().min(side_ - 1).max(0);
    offer(c.x(), c.y(), c.z(), static_cast<std::uint16_t>(i));
  }
  const auto owner = [&](int x, int y, int z) {
    return index_[static_cast<std::size_t>((z * side_ + y) * side_ + x)];
  };
  // Two sweeps along each axis carry every point to all cells.
  for (int pass = 0; pass < 2; ++pass) {
    for (int z = 0; z < side_; ++z) {
      if (z > 0)
        for (int y = 0; y < side_; ++y)
          for (int x = 0; x < side_; ++x) offer(x, y, z, owner(x, y, z - 1));
      for (int y = 0; y < side_; ++y) {
        if (y > 0)
          for (int x = 0; x < side_; ++x) offer(x, y, z, owner(x, y - 1, z));
        for (int x = 1; x < side_; ++x) offer(x, y, z, owner(x - 1, y, z));
        for (int x = side_ - 2; x >= 0; --x) offer(x, y, z, owner(x + 1, y, z));
      }
      for (int y = side_ - 2; y >= 0; --y)
        for (int x = 0; x < side_; ++x) offer(x, y, z, owner(x, y + 1, z));
    }
    for (int z = side_ - 2; z >= 0; --z)
      for (int y = 0; y < side_; ++y)
        for (int x = 0; x < side_; ++x) offer(x, y, z, owner(x, y, z + 1));
  }
}

}  // namespace orbitfuse::registration
