// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/comparison/temperature_difference.hpp"

namespace orbitfuse::comparison {

/// A connected part of the surface that is warmer, colder, or not where it was.
struct DifferenceRegion {
  std::vector<std::size_t> vertices;
  double area = 0;                                   ///< square units of the mesh
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of its area
  Eigen::Vector3d place = Eigen::Vector3d::Zero();   ///< of its strongest (or middlemost) vertex
  double difference_k = 0, uncertainty_k = 0;        ///< medians by area; 0 of changed geometry
  double strongest_k = 0;                            ///< of one vertex, by size
};

/// Parts where the difference, less `common_k`, is larger than least_difference_k and than its own
/// uncertainty, of one sign; largest difference first. Parts below least_region_area are left out.
std::vector<DifferenceRegion> difference_regions(const TriangleMesh& after,
                                                 const std::vector<PointDifference>& points,
                                                 double common_k, const ComparisonOptions& options);

/// Parts of a surface that changed; largest first.
std::vector<DifferenceRegion> changed_regions(const TriangleMesh& surface,
                                              const std::vector<SurfaceChange>& change,
                                              const ComparisonOptions& options);

/// So near to where a part came, the foot of it can't be told from the surface that it stands on:
/// what is the same within `options.foot_reach` of a region counts as changed.
void add_feet(const TriangleMesh& surface, const std::vector<DifferenceRegion>& changed,
              const ComparisonOptions& options, std::vector<SurfaceChange>& change);

}  // namespace orbitfuse::comparison
