// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/prepared_cloud.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <unordered_map>

namespace orbitfuse::registration {
namespace {

struct Adaptor {
  const Points& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t d) const { return points[i][static_cast<Eigen::Index>(d)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const { return false; }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3>;

double percentile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

Eigen::Vector3d median_of(const Points& points) {
  Eigen::Vector3d median;
  std::vector<double> axis(points.size());
  for (int d = 0; d < 3; ++d) {
    std::transform(points.begin(), points.end(), axis.begin(), [d](const auto& p) { return p[d]; });
    median[d] = percentile(axis, 0.5);
  }
  return median;
}

/// Centre and size that neither density nor a few far points move: mean of the bounding values at
/// 5 and 95 %, and the root mean square radius of the inner 90 %.
Similarity3d unit_frame(const Points& points) {
  const Eigen::Vector3d center = median_of(points);
  std::vector<double> radii(points.size());
  std::transform(points.begin(), points.end(), radii.begin(), [&](const auto& p) { return (p - center).norm(); });
  const double radius = percentile(radii, 0.9);
  Similarity3d unit;
  unit.scale = radius > 0 ? 1.0 / radius : 1.0;
  unit.translation = -unit.scale * center;
  return unit;
}

Points thinned(const Points& points, double voxel) {
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0;
    std::size_t order = 0;
  };
  std::unordered_map<std::uint64_t, Cell> cells;
  cells.reserve(points.size());
  for (const auto& p : points) {
    const Eigen::Array3d c = (p.array() / voxel).floor() + 1048576.0;
    const Eigen::Array3d k = c.min(2097151.0).max(0.0);
    const auto key = static_cast<std::uint64_t>(k.x()) << 42 | static_cast<std::uint64_t>(k.y()) << 21 | static_cast<std::uint64_t>(k.z());
    Cell& cell = cells[key];
    if (cell.count == 0) cell.order = cells.size();
    cell.sum += p;
    cell.count += 1;
  }
  // In order of first appearance: hash order must not decide anything.
  std::vector<const Cell*> sorted;
  for (const auto& entry : cells) sorted.push_back(&entry.second);
  std::sort(sorted.begin(), sorted.end(), [](const Cell* a, const Cell* b) { return a->order < b->order; });
  Points out;
  for (const Cell* cell : sorted) out.push_back(cell->sum / cell->count);
  return out;
}

/// The finest voxel that leaves at most the wanted number of points.
Points thinned_to(const Points& points, int wanted) {
  if (static_cast<int>(points.size()) <= wanted) return thinned(points, 1e-6);
  double low = 1e-4, high = 1.0;
  Points best = thinned(points, high);
  for (int i = 0; i < 12; ++i) {
    const double voxel = std::sqrt(low * high);
    Points candidate = thinned(points, voxel);
    if (static_cast<int>(candidate.size()) > wanted) {
      low = voxel;
    } else {
      high = voxel;
      best = std::move(candidate);
      if (static_cast<int>(best.size()) > 0.93 * wanted) break;
    }
  }
  return best;
}

/// Splits the log distance to the 6th neighbour into two populations (Otsu). Only when they are far
/// apart and the near one is a surface worth keeping are the far ones outliers.
Points without_outliers(const Points& points) {
  constexpr std::size_t k = 7;
  if (points.size() < 200) return points;
  const Adaptor adaptor{points};
  Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(12));
  tree.buildIndex();
  std::vector<double> logs(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::size_t index[k];
    double d2[k];
    tree.knnSearch(points[i].data(), k, index, d2);
    logs[i] = 0.5 * std::log(std::max(d2[k - 1], 1e-18));
  }
  std::vector<double> sorted = logs;
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> prefix(sorted.size() + 1, 0), squares(sorted.size() + 1, 0);
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    prefix[i + 1] = prefix[i] + sorted[i];
    squares[i + 1] = squares[i] + sorted[i] * sorted[i];
  }
  const auto stats = [&](std::size_t a, std::size_t b) {
    const double n = static_cast<double>(b - a), m = (prefix[b] - prefix[a]) / n;
    return std::pair(m, std::max(0.0, (squares[b] - squares[a]) / n - m * m));
  };
  const std::size_t n = sorted.size();
  double best = INFINITY;
  std::size_t split = n;
  for (std::size_t i = n / 10; i < n - n / 50; ++i) {
    const double within = static_cast<double>(i) * stats(0, i).second + static_cast<double>(n - i) * stats(i, n).second;
    if (within < best) {
      best = within;
      split = i;
    }
  }
  const auto [near_mean, near_var] = stats(0, split);
  const auto [far_mean, far_var] = stats(split, n);
  const double separation = (far_mean - near_mean) / std::sqrt(near_var + far_var + 1e-6);
  if (!(separation > 2.2 && far_mean - near_mean > std::log(1.8))) return points;
  const double limit = sorted[split];
  Points kept;
  for (std::size_t i = 0; i < n; ++i) {
    if (logs[i] < limit) kept.push_back(points[i]);
  }
  return kept;
}

void estimate_normals(PreparedCloud& cloud) {
  constexpr std::size_t k = 12;
  const Adaptor adaptor{cloud.points};
  Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(12));
  tree.buildIndex();
  const std::size_t neighbours = std::min(k, cloud.points.size());
  cloud.normals.resize(cloud.points.size());
  cloud.planarity.resize(cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    std::size_t index[k];
    double d2[k];
    tree.knnSearch(cloud.points[i].data(), neighbours, index, d2);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < neighbours; ++j) mean += cloud.points[index[j]];
    mean /= static_cast<double>(neighbours);
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (std::size_t j = 0; j < neighbours; ++j) {
      const Eigen::Vector3d d = cloud.points[index[j]] - mean;
      scatter += d * d.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(scatter);
    Eigen::Vector3d normal = solver.eigenvectors().col(0);
    if (normal.dot(cloud.points[i]) < 0) normal = -normal;  // the centre is the origin
    cloud.normals[i] = normal;
    const Eigen::Vector3d& e = solver.eigenvalues();
    cloud.planarity[i] = e[1] > 0 ? std::clamp(1 - e[0] / e[1], 0.0, 1.0) : 0.0;
  }
}

}  // namespace

Result<PreparedCloud> prepare(const PointCloud& cloud, const RegistrationOptions& options, const std::string& name) {
  const auto unusable = [&](const std::string& found) {
    return fail(ErrorKind::input, name, found, "registration needs a cloud that fills space: use views from more sides");
  };
  PreparedCloud prepared;
  Points finite;
  for (const auto& p : cloud.positions) {
    if (p.allFinite()) finite.push_back(p);
  }
  prepared.dropped_not_finite = cloud.size() - finite.size();
  if (finite.size() < 20) return unusable(fmt::format("{} finite points, at least 20 are needed", finite.size()));

  // Coordinates near the origin first; a large offset would eat their digits.
  const Eigen::Vector3d origin = finite[0];
  for (auto& p : finite) p -= origin;
  const Similarity3d rough = unit_frame(finite);
  double spread = 0;
  for (auto& p : finite) {
    p = rough * p;
    spread = std::max(spread, p.cwiseAbs().maxCoeff());
  }
  Points points = thinned_to(finite, 4 * options.points);
  if (points.size() < 20) return unusable(fmt::format("{} distinct points, at least 20 are needed", points.size()));
  const std::size_t before = points.size();
  if (options.filter_outliers) points = without_outliers(points);
  prepared.dropped_outliers = before - points.size();
  const Similarity3d fine = unit_frame(points);
  for (auto& p : points) p = fine * p;
  prepared.points = thinned_to(points, options.points);
  if (prepared.points.size() < 20) return unusable(fmt::format("{} distinct points, at least 20 are needed", prepared.points.size()));

  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : prepared.points) mean += p;
  mean /= static_cast<double>(prepared.points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : prepared.points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d extent = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues();
  if (!(extent[2] > 0)) return unusable("all points in one place");
  if (extent[1] < 1e-6 * extent[2]) return unusable("all points on one line");
  if (extent[0] < 1e-6 * extent[2]) return unusable("all points on one plane");

  Similarity3d from_origin;
  from_origin.translation = -origin;
  prepared.unit_from_cloud = fine * rough * from_origin;
  estimate_normals(prepared);
  prepared.nearest.build(prepared.points, 56, 0.35);
  return prepared;
}

}  // namespace orbitfuse::registration
