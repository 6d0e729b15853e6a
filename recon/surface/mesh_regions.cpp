// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/mesh_regions.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace orbitfuse {
namespace {

/// Union-find with path halving.
std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

}  // namespace

std::vector<double> vertex_areas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0);
  const auto& p = mesh.vertices.positions;
  for (const auto& t : mesh.triangles) {
    const double area = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).norm() / 2;
    if (!std::isfinite(area)) continue;
    for (const std::uint32_t v : t) areas[v] += area / 3;
  }
  return areas;
}

std::vector<MeshRegion> connected_regions(const TriangleMesh& mesh,
                                          const std::vector<int>& labels) {
  std::vector<std::uint32_t> parent(labels.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (const auto& t : mesh.triangles)
    for (const auto& [a, b] : {std::pair(t[0], t[1]), {t[1], t[2]}})
      if (labels[a] == labels[b]) parent[root_of(parent, a)] = root_of(parent, b);
  const std::vector<double> areas = vertex_areas(mesh);
  std::map<std::uint32_t, MeshRegion> by_root;
  for (std::uint32_t v = 0; v < labels.size(); ++v) {
    if (labels[v] == 0) continue;
    MeshRegion& region = by_root[root_of(parent, v)];
    region.label = labels[v];
    region.vertices.push_back(v);
    region.area += areas[v];
    region.center += areas[v] * mesh.vertices.positions[v];
  }
  std::vector<MeshRegion> regions;
  for (auto& [root, region] : by_root) {
    if (!(region.area > 0)) continue;
    region.center /= region.area;
    regions.push_back(std::move(region));
  }
  std::stable_sort(regions.begin(), regions.end(),
                   [](const MeshRegion& a, const MeshRegion& b) { return a.area > b.area; });
  return regions;
}

}  // namespace orbitfuse
