// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/warp_grid.hpp"

namespace orbitfuse::registration {
namespace {

int flat(const Eigen::Array3i& at, const Eigen::Array3i& count) {
  return at[0] + count[0] * (at[1] + count[1] * at[2]);
}

Eigen::Array3i corner_offset(int k) { return {k & 1, (k >> 1) & 1, k >> 2}; }

}  // namespace

WarpGrid::WarpGrid(const Points& points, double spacing, int fewest_points, std::size_t most_nodes)
    : spacing_(spacing) {
  if (points.empty()) return;
  build(points, fewest_points);
  while (nodes_.size() > most_nodes) {
    spacing_ *= 1.25;
    build(points, fewest_points);
  }
  displacements_.assign(nodes_.size(), Eigen::Vector3d::Zero());
}

void WarpGrid::build(const Points& points, int fewest_points) {
  Eigen::Array3d low = points[0], high = points[0];
  for (const auto& p : points) {
    low = low.min(p.array());
    high = high.max(p.array());
  }
  count_ = ((high - low) / spacing_).ceil().cast<int>().max(1);
  origin_ = 0.5 * (low + high) - 0.5 * spacing_ * count_.cast<double>();
  std::vector<int> points_in(static_cast<std::size_t>(count_.prod()), 0);
  const auto cell_of = [&](const Eigen::Vector3d& p) {
    const Eigen::Array3i c = ((p - origin_).array() / spacing_).floor().cast<int>();
    return static_cast<std::size_t>(flat(c.max(0).min(count_ - 1), count_));
  };
  for (const auto& p : points) ++points_in[cell_of(p)];

  cell_at_.assign(points_in.size(), std::nullopt);
  cells_.clear();
  nodes_.clear();
  const Eigen::Array3i corner_count = count_ + 1;
  std::vector<std::optional<int>> node_at(static_cast<std::size_t>(corner_count.prod()));
  Eigen::Array3i c;
  for (c[2] = 0; c[2] < count_[2]; ++c[2]) {
    for (c[1] = 0; c[1] < count_[1]; ++c[1]) {
      for (c[0] = 0; c[0] < count_[0]; ++c[0]) {
        const auto cell = static_cast<std::size_t>(flat(c, count_));
        if (points_in[cell] < fewest_points) continue;
        cell_at_[cell] = cells_.size();
        std::array<int, cell_corners>& corners = cells_.emplace_back();
        for (int k = 0; k < cell_corners; ++k) {
          const Eigen::Array3i at = c + corner_offset(k);
          std::optional<int>& node = node_at[static_cast<std::size_t>(flat(at, corner_count))];
          if (!node) {
            node = static_cast<int>(nodes_.size());
            nodes_.push_back(origin_ + spacing_ * at.cast<double>().matrix());
          }
          corners[static_cast<std::size_t>(k)] = *node;
        }
      }
    }
  }
}

std::optional<WarpGrid::Place> WarpGrid::place(const Eigen::Vector3d& x) const {
  const Eigen::Array3d u = (x - origin_).array() / spacing_;
  if (!((u >= 0).all() && (u <= count_.cast<double>()).all())) return std::nullopt;
  const Eigen::Array3i c = u.cast<int>().min(count_ - 1);
  const std::optional<std::size_t> cell = cell_at_[static_cast<std::size_t>(flat(c, count_))];
  if (!cell) return std::nullopt;
  Place place{.cell = *cell, .weights = {}};
  const Eigen::Array3d f = u - c.cast<double>();
  for (int k = 0; k < cell_corners; ++k) {
    const Eigen::Array3i o = corner_offset(k);
    place.weights[static_cast<std::size_t>(k)] =
        (o[0] ? f[0] : 1 - f[0]) * (o[1] ? f[1] : 1 - f[1]) * (o[2] ? f[2] : 1 - f[2]);
  }
  return place;
}

Eigen::Vector3d WarpGrid::displacement(const Place& place) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const auto& nodes = corners(place.cell);
  for (std::size_t k = 0; k < cell_corners; ++k)
    sum += place.weights[k] * displacements_[static_cast<std::size_t>(nodes[k])];
  return sum;
}

void WarpGrid::displace(const Eigen::VectorXd& by_node) {
  for (std::size_t i = 0; i < displacements_.size(); ++i)
    displacements_[i] = by_node.segment<3>(3 * static_cast<Eigen::Index>(i));
}

}  // namespace orbitfuse::registration
