// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>

#include "core/geometry/point_cloud.hpp"
#include "recon/registration/clouds/nearest_grid.hpp"
#include "recon/registration/register.hpp"
#include "recon/registration/similarity.hpp"

namespace orbitfuse::registration {

/// A cloud as the search uses it: finite points only, outliers dropped, centred and scaled to a
/// robust radius of 1 (unit_from_cloud), evenly thinned, with normals.
struct PreparedCloud {
  static constexpr std::size_t neighbour_count = 12;

  Similarity3d unit_from_cloud;
  Points points;
  Points normals;  ///< unit length, signs consistent along the surface
  /// 0..1, of the normal: the root of its neighbourhood's planarity. Planarity itself would leave
  /// warped surfaces with too few points to average over, none would let outliers pull.
  std::vector<double> trust;
  std::vector<std::array<std::uint32_t, neighbour_count>> neighbours;
  NearestGrid nearest_table;
  std::size_t dropped_not_finite = 0, dropped_outliers = 0;

  /// Index of the (all but always) nearest point; nothing far outside the cloud's box.
  std::optional<std::size_t> nearest(const Eigen::Vector3d& x) const {
    const std::optional<std::size_t> found = nearest_table.lookup(x);
    if (!found) return found;
    std::size_t best = *found;
    double best_d2 = (points[best] - x).squaredNorm();
    // The table is exact to a cell; one greedy step to a neighbour makes up for it.
    for (const std::uint32_t j : neighbours[*found]) {
      const double d2 = (points[j] - x).squaredNorm();
      if (d2 < best_d2) {
        best_d2 = d2;
        best = j;
      }
    }
    return best;
  }
};

/// Input errors: fewer than 20 finite or distinct points; all in one place, on one line or plane.
Result<PreparedCloud> prepare(const PointCloud& cloud, const RegistrationOptions& options,
                              const std::string& name);

}  // namespace orbitfuse::registration
