// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/distance_grid.hpp"

#include <algorithm>
#include <cmath>

namespace orbitfuse {

DistanceGrid::DistanceGrid(const Eigen::AlignedBox3d& box, int resolution)
    : low_(box.min()), size_(box.sizes().maxCoeff() / resolution) {
  for (int d = 0; d < 3; ++d)
    blocks_[d] = std::clamp(static_cast<int>(std::ceil((box.sizes()[d] / size_ + 1) / block_side)),
                            1, resolution / block_side + 1);
  index_.assign(static_cast<std::size_t>(blocks_[0]) * static_cast<std::size_t>(blocks_[1]) *
                    static_cast<std::size_t>(blocks_[2]),
                -1);
}

void DistanceGrid::hold(const Eigen::Vector3d& point, double reach) {
  const double side = size_ * block_side;
  Eigen::Array3i from, to;
  for (int d = 0; d < 3; ++d) {
    const double low = std::floor((point[d] - reach - low_[d]) / side);
    const double high = std::floor((point[d] + reach - low_[d]) / side);
    if (!(high >= 0 && low < blocks_[d])) return;  // NaN too
    from[d] = static_cast<int>(std::max(0.0, low));
    to[d] = static_cast<int>(std::min(blocks_[d] - 1.0, high));
  }
  Eigen::Array3i b;
  for (b[2] = from[2]; b[2] <= to[2]; ++b[2])
    for (b[1] = from[1]; b[1] <= to[1]; ++b[1])
      for (b[0] = from[0]; b[0] <= to[0]; ++b[0]) index_[place(b)] = 0;
}

void DistanceGrid::allocate() {
  Eigen::Array3i b;
  for (b[2] = 0; b[2] < blocks_[2]; ++b[2])
    for (b[1] = 0; b[1] < blocks_[1]; ++b[1])
      for (b[0] = 0; b[0] < blocks_[0]; ++b[0]) {
        std::int32_t& index = index_[place(b)];
        if (index < 0) continue;
        index = static_cast<std::int32_t>(held_.size());
        held_.push_back(b);
      }
  data_.assign(held_.size(), Block{});
}

std::int64_t DistanceGrid::index_of(const Eigen::Array3i& voxel) const {
  if ((voxel < 0).any()) return -1;
  const Eigen::Array3i b = voxel / block_side;
  if ((b >= blocks_).any()) return -1;
  const std::int32_t block = index_[place(b)];
  return block < 0 ? -1 : static_cast<std::int64_t>(block) * block_voxels + index_in_block(voxel);
}

}  // namespace orbitfuse
