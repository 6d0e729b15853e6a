// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace orbitfuse {

/// Signed distances on a regular grid of which only blocks near surfaces are held. Voxel (i, j, k)
/// lies at low + size * (i, j, k).
class DistanceGrid {
 public:
  static constexpr int block_side = 8;
  static constexpr int block_voxels = block_side * block_side * block_side;
  struct Voxel {
    float distance = 0;  ///< mean of the views', in truncation lengths, positive outside
    float weight = 0;
  };
  using Block = std::array<Voxel, block_voxels>;

  DistanceGrid(const Eigen::AlignedBox3d& box, int resolution);

  double voxel_size() const { return size_; }
  const Eigen::Array3i& blocks_per_axis() const { return blocks_; }
  Eigen::Vector3d position(const Eigen::Array3i& voxel) const {
    return low_ + size_ * voxel.cast<double>().matrix();
  }
  /// Holds all blocks that a cube of half side `reach` round the point touches.
  void hold(const Eigen::Vector3d& point, double reach);
  /// Gives the blocks that are to be held their voxels, in the order of their place.
  void allocate();

  std::size_t size() const { return held_.size(); }
  Eigen::Array3i first_voxel(std::size_t block) const { return block_side * held_[block]; }
  Block& block(std::size_t index) { return data_[index]; }
  const Block& block(std::size_t index) const { return data_[index]; }
  static int index_in_block(const Eigen::Array3i& v) {
    return (v[2] % block_side * block_side + v[1] % block_side) * block_side + v[0] % block_side;
  }
  /// Index of the voxel among all that are held; -1 where it isn't.
  std::int64_t index_of(const Eigen::Array3i& voxel) const;
  const Voxel& at(std::int64_t index) const {
    return data_[static_cast<std::size_t>(index / block_voxels)]
                [static_cast<std::size_t>(index % block_voxels)];
  }

 private:
  std::size_t place(const Eigen::Array3i& block) const {
    return (static_cast<std::size_t>(block[2]) * static_cast<std::size_t>(blocks_[1]) +
            static_cast<std::size_t>(block[1])) *
               static_cast<std::size_t>(blocks_[0]) +
           static_cast<std::size_t>(block[0]);
  }
  Eigen::Vector3d low_;
  double size_;
  Eigen::Array3i blocks_;
  std::vector<std::int32_t> index_;  ///< of each block's place: -1 not held, before allocate 0 held
  std::vector<Eigen::Array3i> held_;
  std::vector<Block> data_;
};

}  // namespace orbitfuse
