// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "recon/registration/similarity.hpp"

namespace orbitfuse::registration {

/// A displacement field on the corners of a cubic grid, trilinear between them. Only cells with
/// enough points have corners: elsewhere there is no displacement, and nothing to solve for.
class WarpGrid {
 public:
  static constexpr int cell_corners = 8;
  struct Place {
    std::size_t cell;
    std::array<double, cell_corners> weights;
  };

  /// The spacing grows until there are no more than `most_nodes` corners.
  WarpGrid(const Points& points, double spacing, int fewest_points, std::size_t most_nodes);

  /// Nothing outside of all cells.
  std::optional<Place> place(const Eigen::Vector3d& x) const;
  /// Corners of a cell, in the order of Place::weights: indices of nodes.
  const std::array<int, cell_corners>& corners(std::size_t cell) const { return cells_[cell]; }
  std::size_t cell_count() const { return cells_.size(); }
  const Points& nodes() const { return nodes_; }
  double spacing() const { return spacing_; }

  Eigen::Vector3d displacement(const Place& place) const;
  /// Zero outside.
  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const {
    const std::optional<Place> at = place(x);
    return at ? displacement(*at) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  void displace(const Eigen::VectorXd& by_node);  ///< x, y, z of each node in turn

 private:
  void build(const Points& points, int fewest_points);

  double spacing_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Eigen::Array3i count_ = Eigen::Array3i::Zero();    ///< cells a side
  std::vector<std::optional<std::size_t>> cell_at_;  ///< nothing where there are too few points
  std::vector<std::array<int, cell_corners>> cells_;
  Points nodes_, displacements_;
};

}  // namespace orbitfuse::registration
