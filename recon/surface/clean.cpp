// SPDX-License-Identifier: BSD-3-Clause
#include <meshoptimizer.h>

#include <numeric>

#include "recon/surface/surface.hpp"

namespace orbitfuse {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Eigen::Vector3d doubled_area(const TriangleMesh& mesh, const Triangle& t) {
  const auto& p = mesh.vertices.positions;
  return (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
}

/// The vertices that triangles use, with their attributes.
TriangleMesh compacted(const PointCloud& vertices, const std::vector<Triangle>& triangles) {
  constexpr std::uint32_t unused = 0xFFFFFFFFU;
  std::vector<std::uint32_t> renamed(vertices.size(), unused);
  TriangleMesh result;
  for (const Triangle& t : triangles) {
    Triangle kept;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t v = t[c];
      if (renamed[v] == unused) {
        renamed[v] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.positions.push_back(vertices.positions[v]);
        if (!vertices.normals.empty()) result.vertices.normals.push_back(vertices.normals[v]);
        if (!vertices.colors.empty()) result.vertices.colors.push_back(vertices.colors[v]);
        if (!vertices.temperatures_k.empty())
          result.vertices.temperatures_k.push_back(vertices.temperatures_k[v]);
      }
      kept[c] = renamed[v];
    }
    result.triangles.push_back(kept);
  }
  return result;
}

/// Union-find over vertices that share triangles.
class Pieces {
 public:
  explicit Pieces(std::size_t vertices) : parent_(vertices) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[root(a)] = root(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

TriangleMesh without_small_pieces(const TriangleMesh& mesh, double least_size) {
  std::vector<Triangle> usable;
  for (const Triangle& t : mesh.triangles) {
    const double area = doubled_area(mesh, t).squaredNorm();
    if (area > 0 && std::isfinite(area)) usable.push_back(t);
  }
  Pieces pieces(mesh.vertices.size());
  for (const Triangle& t : usable) {
    pieces.join(t[0], t[1]);
    pieces.join(t[0], t[2]);
  }
  std::vector<Eigen::AlignedBox3d> boxes(mesh.vertices.size());
  for (const Triangle& t : usable)
    for (const std::uint32_t v : t) boxes[pieces.root(v)].extend(mesh.vertices.positions[v]);
  std::vector<Triangle> kept;
  for (const Triangle& t : usable)
    if (boxes[pieces.root(t[0])].diagonal().norm() >= least_size) kept.push_back(t);
  return compacted(mesh.vertices, kept);
}

TriangleMesh simplified(const TriangleMesh& mesh, int triangles) {
  const auto wanted = static_cast<std::size_t>(triangles);
  if (mesh.triangles.size() <= wanted) return mesh;
  std::vector<unsigned> indices;
  for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  std::vector<float> positions;
  for (const Eigen::Vector3d& p : mesh.vertices.positions)
    for (int d = 0; d < 3; ++d) positions.push_back(static_cast<float>(p[d]));
  std::vector<unsigned> kept(indices.size());
  // The number of triangles is what was asked for, so the error may be what it takes.
  constexpr float any_error = 1;
  kept.resize(meshopt_simplify(kept.data(), indices.data(), indices.size(), positions.data(),
                               mesh.vertices.size(), 3 * sizeof(float), 3 * wanted, any_error));
  std::vector<Triangle> left;
  for (std::size_t i = 0; i + 2 < kept.size(); i += 3)
    left.push_back({kept[i], kept[i + 1], kept[i + 2]});
  return compacted(mesh.vertices, left);
}

std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> sum(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d normal = doubled_area(mesh, t);
    if (!normal.allFinite()) continue;
    for (const std::uint32_t v : t) sum[v] += normal;
  }
  std::vector<Eigen::Vector3f> normals;
  for (const Eigen::Vector3d& n : sum) {
    const double length = n.norm();
    normals.push_back(length > 0 ? (n / length).cast<float>().eval() : Eigen::Vector3f::Zero());
  }
  return normals;
}

}  // namespace orbitfuse
