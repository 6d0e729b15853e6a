// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/clouds/prepared_cloud.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <queue>
#include <tuple>

#include "core/geometry/kd_tree.hpp"
#include "core/numeric/median.hpp"
#include "recon/registration/clouds/outlier_filter.hpp"
#include "recon/registration/clouds/thinning.hpp"

namespace orbitfuse::registration {
namespace {

constexpr std::size_t fewest_points_of_cloud = 20;
static_assert(fewest_points_of_cloud > PreparedCloud::neighbour_count);

/// Coordinate medians as the centre, 90 % of the points within radius 1: few far points move
/// neither.
Similarity3d unit_frame(const Points& points) {
  Eigen::Vector3d center;
  std::vector<double> values(points.size());
  for (int d = 0; d < 3; ++d) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [d](const auto& p) { return p[d]; });
    center[d] = quantile(values, 0.5);
  }
  std::transform(points.begin(), points.end(), values.begin(),
                 [&](const auto& p) { return (p - center).norm(); });
  double radius = quantile(values, 0.9);
  if (!(radius > 0)) radius = *std::max_element(values.begin(), values.end());
  Similarity3d unit;
  unit.scale = radius > 0 ? 1.0 / radius : 1.0;
  unit.translation = -unit.scale * center;
  return unit;
}

/// Normals and their trust from the scatter of the nearest neighbours.
void estimate_normals(PreparedCloud& cloud) {
  constexpr std::size_t k = PreparedCloud::neighbour_count + 1;  // and the point itself
  const KdTree tree(cloud.points);
  const std::size_t n = cloud.points.size();
  cloud.normals.resize(n);
  cloud.trust.resize(n);
  cloud.neighbours.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t index[k];
    double d2[k];
    const std::size_t found = tree.nearest(cloud.points[i], k, index, d2);
    assert(found == k && "no cloud is as small as a neighbourhood");
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < found; ++j) mean += cloud.points[index[j]];
    mean /= static_cast<double>(found);
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (std::size_t j = 0, slot = 0; j < found; ++j) {
      const Eigen::Vector3d d = cloud.points[index[j]] - mean;
      scatter += d * d.transpose();
      if (index[j] != i && slot < PreparedCloud::neighbour_count) {
        cloud.neighbours[i][slot++] = static_cast<std::uint32_t>(index[j]);
      }
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(scatter);
    const Eigen::Vector3d& e = solver.eigenvalues();
    cloud.normals[i] = solver.eigenvectors().col(0);
    cloud.trust[i] = e[1] > 0 ? std::sqrt(std::clamp(1 - e[0] / e[1], 0.0, 1.0)) : 0.0;
  }
}

/// Signs carried along the neighbour graph, flattest edges first (Hoppe et al. 1992); each
/// connected part then points away from the cloud's centre as a whole.
void orient_normals(PreparedCloud& cloud) {
  struct Edge {
    double cost;
    std::size_t from, to;
    bool operator<(const Edge& other) const {
      return std::tie(cost, to, from) > std::tie(other.cost, other.to, other.from);
    }
  };
  const std::size_t n = cloud.points.size();
  std::vector<char> done(n, 0);
  std::priority_queue<Edge> edges;
  std::vector<std::size_t> part;
  const auto visit = [&](std::size_t i) {
    done[i] = 1;
    part.push_back(i);
    for (const std::uint32_t to : cloud.neighbours[i]) {
      if (!done[to]) edges.push({1 - std::abs(cloud.normals[i].dot(cloud.normals[to])), i, to});
    }
  };
  for (std::size_t seed = 0; seed < n; ++seed) {
    if (done[seed]) continue;
    part.clear();
    visit(seed);
    while (!edges.empty()) {
      const Edge edge = edges.top();
      edges.pop();
      if (done[edge.to]) continue;
      Eigen::Vector3d& normal = cloud.normals[edge.to];
      if (normal.dot(cloud.normals[edge.from]) < 0) normal = -normal;
      visit(edge.to);
    }
    double outward = 0;
    for (const std::size_t i : part) outward += cloud.normals[i].dot(cloud.points[i]);
    if (outward < 0) {
      for (const std::size_t i : part) cloud.normals[i] = -cloud.normals[i];
    }
  }
}

/// "" when the points fill space.
std::string flatness(const Points& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d extent =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues();
  // A noisy wall of 1 % thickness is a plane still: nothing across it but noise.
  constexpr double thin = 3e-4;
  if (!(extent[2] > 0)) return "all points in one place";
  if (extent[1] < thin * extent[2]) return "all points on one line";
  if (extent[0] < thin * extent[2]) return "all points on one plane";
  return {};
}

}  // namespace

Result<PreparedCloud> prepare(const PointCloud& cloud, const RegistrationOptions& options,
                              const std::string& name) {
  const auto unusable = [&](const std::string& found) {
    return fail(ErrorKind::input, name, found,
                "registration needs a cloud that fills space: use views from more sides");
  };
  const auto too_few = [&](std::size_t count, const char* kind) {
    return unusable(
        fmt::format("{} {} points, at least {} are needed", count, kind, fewest_points_of_cloud));
  };
  PreparedCloud prepared;
  Points points;
  for (const auto& p : cloud.positions) {
    if (p.allFinite()) points.push_back(p);
  }
  prepared.dropped_not_finite = cloud.size() - points.size();
  if (points.size() < fewest_points_of_cloud) return too_few(points.size(), "finite");

  // Coordinates near the origin first; a large offset would eat their digits.
  Similarity3d from_origin;
  from_origin.translation = -points[0];
  for (auto& p : points) p += from_origin.translation;
  const Similarity3d rough = unit_frame(points);
  for (auto& p : points) p = rough * p;
  // Nine points of ten lie within 1.
  constexpr double far_bound = 8;
  prepared.dropped_outliers =
      std::erase_if(points, [](const Eigen::Vector3d& p) { return p.norm() > far_bound; });
  points = thinned_to(points, 4 * options.points);
  if (points.size() < fewest_points_of_cloud) return too_few(points.size(), "distinct");
  const std::size_t before = points.size();
  if (options.filter_outliers) points = without_outliers(points);
  prepared.dropped_outliers += before - points.size();

  const Similarity3d fine = unit_frame(points);
  for (auto& p : points) p = fine * p;
  prepared.points = thinned_to(points, options.points);
  if (prepared.points.size() < fewest_points_of_cloud)
    return too_few(prepared.points.size(), "distinct");
  if (const std::string flat = flatness(prepared.points); !flat.empty()) return unusable(flat);
  prepared.unit_from_cloud = fine * rough * from_origin;
  estimate_normals(prepared);
  orient_normals(prepared);
  prepared.nearest_table.build(prepared.points, 56, 0.35);
  return prepared;
}

}  // namespace orbitfuse::registration
