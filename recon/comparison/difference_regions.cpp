// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/difference_regions.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "recon/comparison/surface_points.hpp"
#include "recon/measurement/estimate.hpp"

namespace orbitfuse::comparison {
namespace {

/// Connected vertices of one label; label 0 belongs to none.
std::vector<std::vector<std::size_t>> parts_of(const TriangleMesh& mesh,
                                               const std::vector<int>& labels) {
  std::vector<std::size_t> parent(labels.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = t[k], b = t[(k + 1) % 3];
      if (labels[a] != 0 && labels[a] == labels[b]) parent[root(a)] = root(b);
    }
  std::map<std::size_t, std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i] != 0) parts[root(i)].push_back(i);
  std::vector<std::vector<std::size_t>> result;
  for (auto& [first, part] : parts) result.push_back(std::move(part));
  return result;
}

/// Regions with area and place; small ones are left out.
std::vector<DifferenceRegion> regions_of(const TriangleMesh& mesh, const std::vector<int>& labels,
                                         const std::vector<double>& areas, double least_share) {
  const double least = least_share * std::accumulate(areas.begin(), areas.end(), 0.0);
  std::vector<DifferenceRegion> regions;
  for (auto& part : parts_of(mesh, labels)) {
    DifferenceRegion region;
    for (const std::size_t i : part) {
      region.area += areas[i];
      region.middle += areas[i] * mesh.vertices.positions[i];
    }
    if (!(region.area > 0 && region.area >= least)) continue;
    region.middle /= region.area;
    region.place = mesh.vertices.positions[*std::min_element(
        part.begin(), part.end(), [&](std::size_t a, std::size_t b) {
          return (mesh.vertices.positions[a] - region.middle).squaredNorm() <
                 (mesh.vertices.positions[b] - region.middle).squaredNorm();
        })];
    region.vertices = std::move(part);
    regions.push_back(std::move(region));
  }
  return regions;
}

}  // namespace

std::vector<DifferenceRegion> difference_regions(const TriangleMesh& after,
                                                 const std::vector<PointDifference>& points,
                                                 double common_k,
                                                 const ComparisonOptions& options) {
  std::vector<int> labels(after.vertices.size(), 0);
  for (std::size_t i = 0; i < std::min(labels.size(), points.size()); ++i) {
    const double difference = points[i].difference_k - common_k;
    if (std::abs(difference) > std::max(options.least_difference_k, points[i].uncertainty_k))
      labels[i] = difference > 0 ? 1 : -1;
  }
  const std::vector<double> areas = vertex_areas(after);
  auto regions = regions_of(after, labels, areas, options.least_region_area);
  for (DifferenceRegion& region : regions) {
    std::vector<std::pair<double, double>> differences, uncertainties;
    for (const std::size_t i : region.vertices) {
      if (!(areas[i] > 0)) continue;
      const double difference = points[i].difference_k - common_k;
      differences.emplace_back(difference, areas[i]);
      uncertainties.emplace_back(points[i].uncertainty_k, areas[i]);
      if (std::abs(difference) <= std::abs(region.strongest_k)) continue;
      region.strongest_k = difference;
      region.place = after.vertices.positions[i];
    }
    region.difference_k = measurement::weighted_median(std::move(differences));
    region.uncertainty_k = measurement::weighted_median(std::move(uncertainties));
  }
  std::sort(regions.begin(), regions.end(), [](const auto& a, const auto& b) {
    return std::abs(a.difference_k) > std::abs(b.difference_k);
  });
  return regions;
}

std::vector<DifferenceRegion> changed_regions(const TriangleMesh& surface,
                                              const std::vector<SurfaceChange>& change,
                                              const ComparisonOptions& options) {
  std::vector<int> labels(surface.vertices.size(), 0);
  for (std::size_t i = 0; i < std::min(labels.size(), change.size()); ++i)
    labels[i] = change[i] == SurfaceChange::changed;
  auto regions = regions_of(surface, labels, vertex_areas(surface), options.least_region_area);
  std::sort(regions.begin(), regions.end(),
            [](const auto& a, const auto& b) { return a.area > b.area; });
  return regions;
}

void add_feet(const TriangleMesh& surface, const std::vector<DifferenceRegion>& changed,
              const ComparisonOptions& options, std::vector<SurfaceChange>& change) {
  std::vector<Eigen::Vector3d> came;
  for (const DifferenceRegion& region : changed)
    for (const std::size_t i : region.vertices) came.push_back(surface.vertices.positions[i]);
  if (came.empty()) return;
  const KdTree tree(came);
  const double reach = options.foot_reach * diagonal(surface_points(surface));
  for (std::size_t i = 0; i < std::min(change.size(), surface.vertices.size()); ++i) {
    const Eigen::Vector3d& p = surface.vertices.positions[i];
    std::size_t nearest = 0;
    double d2 = 0;
    if (change[i] == SurfaceChange::same && p.allFinite() &&
        tree.nearest(p, 1, &nearest, &d2) == 1 && d2 <= reach * reach)
      change[i] = SurfaceChange::changed;
  }
}

}  // namespace orbitfuse::comparison
