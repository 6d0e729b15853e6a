// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/surface_nets.hpp"

#include <optional>

namespace orbitfuse {
namespace {

constexpr std::uint32_t no_vertex = 0xFFFFFFFFU;

Eigen::Array3i corner(int c) { return {c & 1, c >> 1 & 1, c >> 2 & 1}; }

class SurfaceNet {
 public:
  SurfaceNet(const DistanceGrid& grid, float least_weight, const Eigen::AlignedBox3d& box)
      : grid_(grid),
        least_weight_(least_weight),
        box_(box),
        vertex_(grid.size() * DistanceGrid::block_voxels, no_vertex) {}

  TriangleMesh make() {
    for_voxels([this](const Eigen::Array3i& v) { place_vertex(v); });
    for_voxels([this](const Eigen::Array3i& v) {
      for (int axis = 0; axis < 3; ++axis) join(v, axis);
    });
    return std::move(mesh_);
  }

 private:
  template <class Function>
  void for_voxels(Function&& use) {
    constexpr int side = DistanceGrid::block_side;
    for (std::size_t b = 0; b < grid_.size(); ++b)
      for (int k = 0; k < DistanceGrid::block_voxels; ++k)
        use(grid_.first_voxel(b) + Eigen::Array3i(k % side, k / side % side, k / (side * side)));
  }

  std::optional<float> distance(const Eigen::Array3i& voxel) const {
    const std::int64_t index = grid_.index_of(voxel);
    if (index < 0) return std::nullopt;
    const DistanceGrid::Voxel& v = grid_.at(index);
    if (v.weight < least_weight_) return std::nullopt;
    return v.distance;
  }

  void place_vertex(const Eigen::Array3i& cell) {
    std::array<float, 8> value;
    int inside = 0;
    for (int c = 0; c < 8; ++c) {
      const auto d = distance(cell + corner(c));
      if (!d) return;
      value[static_cast<std::size_t>(c)] = *d;
      inside += *d < 0;
    }
    if (inside == 0 || inside == 8) return;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int crossings = 0;
    for (int a = 0; a < 8; ++a)
      for (const int bit : {1, 2, 4}) {
        const int b = a | bit;
        if (b == a) continue;
        const float from = value[static_cast<std::size_t>(a)],
                    to = value[static_cast<std::size_t>(b)];
        if ((from < 0) == (to < 0)) continue;
        const double share = static_cast<double>(from / (from - to));
        sum += (1 - share) * corner(a).cast<double>().matrix() +
               share * corner(b).cast<double>().matrix();
        ++crossings;
      }
    const Eigen::Vector3d at = grid_.position(cell) + grid_.voxel_size() * sum / crossings;
    if (!box_.contains(at)) return;
    vertex_[static_cast<std::size_t>(grid_.index_of(cell))] =
        static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.positions.push_back(at);
  }

  /// The four cells round the edge from a voxel along an axis, if its ends have different signs.
  void join(const Eigen::Array3i& voxel, int axis) {
    Eigen::Array3i end = voxel;
    ++end[axis];
    const auto from = distance(voxel), to = distance(end);
    if (!from || !to || (*from < 0) == (*to < 0)) return;
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    std::array<std::uint32_t, 4> quad;
    for (std::size_t k = 0; k < 4; ++k) {
      Eigen::Array3i cell = voxel;
      cell[b] -= k == 0 || k == 3;
      cell[c] -= k < 2;
      const std::int64_t index = grid_.index_of(cell);
      quad[k] = index < 0 ? no_vertex : vertex_[static_cast<std::size_t>(index)];
      if (quad[k] == no_vertex) return;
    }
    if (*from > 0) std::swap(quad[1], quad[3]);  // outside is where distances are positive
    const auto& p = mesh_.vertices.positions;
    if ((p[quad[0]] - p[quad[2]]).squaredNorm() <= (p[quad[1]] - p[quad[3]]).squaredNorm()) {
      mesh_.triangles.push_back({quad[0], quad[1], quad[2]});
      mesh_.triangles.push_back({quad[0], quad[2], quad[3]});
    } else {
      mesh_.triangles.push_back({quad[1], quad[2], quad[3]});
      mesh_.triangles.push_back({quad[1], quad[3], quad[0]});
    }
  }

  const DistanceGrid& grid_;
  const float least_weight_;
  const Eigen::AlignedBox3d& box_;
  std::vector<std::uint32_t> vertex_;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh surface_net(const DistanceGrid& grid, float least_weight,
                         const Eigen::AlignedBox3d& box) {
  return SurfaceNet(grid, least_weight, box).make();
}

}  // namespace orbitfuse
