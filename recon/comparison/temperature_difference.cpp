// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/temperature_difference.hpp"

#include <cmath>
#include <limits>

#include "recon/comparison/surface_points.hpp"
#include "recon/measurement/estimate.hpp"
#include "recon/measurement/region.hpp"

namespace orbitfuse::comparison {
namespace {
using measurement::SurfacePoint;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A field's temperature at each vertex, NaN where there is none.
double field_of(const TriangleMesh& mesh, std::size_t i) {
  const auto& t = mesh.vertices.temperatures_k;
  return i < t.size() ? static_cast<double>(t[i]) : nan;
}

/// Steepest change of the field's temperature along the edges at each vertex, kelvin per unit.
std::vector<double> gradients(const TriangleMesh& mesh) {
  std::vector<double> result(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = t[k], b = t[(k + 1) % 3];
      const double length = (mesh.vertices.positions[a] - mesh.vertices.positions[b]).norm();
      const double slope = std::abs(field_of(mesh, a) - field_of(mesh, b)) / length;
      if (!std::isfinite(slope)) continue;
      result[a] = std::max(result[a], slope);
      result[b] = std::max(result[b], slope);
    }
  return result;
}

}  // namespace

std::vector<double> vertex_areas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) {
    const auto& p = mesh.vertices.positions;
    const double area = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).norm() / 2;
    if (std::isfinite(area))
      for (const std::uint32_t corner : t) areas[corner] += area / 3;
  }
  return areas;
}

Result<std::vector<PointDifference>> temperature_difference(const ComparedSurface& s,
                                                            const measurement::ThermalScene& after,
                                                            const measurement::ThermalScene& before,
                                                            const Progress& progress) {
  const PointCloud& vertices = s.after->vertices;
  if (s.change.size() != vertices.size() || vertices.normals.size() != vertices.size())
    return fail(ErrorKind::input, "the surface", "changes or normals that are not one a vertex",
                "compare the surfaces first");
  const SurfacePoints there = surface_points(*s.before);
  if (there.size() == 0)
    return fail(ErrorKind::input, "the earlier surface", "no vertex", "reconstruct it first");
  const KdTree tree(there.positions);
  std::vector<std::size_t> compared;
  std::vector<SurfacePoint> in_after, in_before;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (s.change[i] != SurfaceChange::same) continue;
    const Eigen::Vector3d x = s.before_from_after * vertices.positions[i],
                          normal = vertices.normals[i].cast<double>();
    std::size_t nearest = 0;
    double d2 = 0;
    tree.nearest(x, 1, &nearest, &d2);
    compared.push_back(i);
    in_after.push_back({vertices.positions[i], normal, field_of(*s.after, i), 0, 1});
    in_before.push_back({x, s.before_from_after.rotation * normal,
                         field_of(*s.before, there.index[nearest]), 0, 1});
  }
  ORBITFUSE_ASSIGN(const auto later, measurement::read_points(after, in_after, {}, progress));
  ORBITFUSE_ASSIGN(const auto earlier, measurement::read_points(before, in_before, {}, progress));
  const std::vector<double> slopes = gradients(*s.after);
  const double shift = s.residual / s.before_from_after.scale;
  std::vector<PointDifference> result(vertices.size(), {nan, nan, nan, nan});
  for (std::size_t k = 0; k < compared.size(); ++k) {
    // Frames that contradict each other show an edge: their mean is nobody's temperature.
    if (!later[k].seen() || !earlier[k].seen() || later[k].two_camps || earlier[k].two_camps)
      continue;
    PointDifference& point = result[compared[k]];
    point.after_k = later[k].temperature_k;
    point.before_k = earlier[k].temperature_k;
    point.difference_k = point.after_k - point.before_k;
    const double misplaced = after.options().coverage_factor * slopes[compared[k]] * shift;
    point.uncertainty_k = std::hypot(later[k].uncertainty_k, earlier[k].uncertainty_k, misplaced);
  }
  return result;
}

std::optional<double> common_difference(const TriangleMesh& after,
                                        const std::vector<PointDifference>& points) {
  const std::vector<double> areas = vertex_areas(after);
  std::vector<std::pair<double, double>> list;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].known() && areas[i] > 0) list.emplace_back(points[i].difference_k, areas[i]);
  if (list.empty()) return std::nullopt;
  return measurement::weighted_median(std::move(list));
}

}  // namespace orbitfuse::comparison
