// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/register_surfaces.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "core/geometry/kd_tree.hpp"
#include "core/geometry/rotation_vector.hpp"
#include "core/numeric/median.hpp"
#include "recon/comparison/surface_points.hpp"

namespace orbitfuse::comparison {
namespace {
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

constexpr double start_reach = 0.04, end_reach = 0.01;  // of the diagonal: partners that count
constexpr int rounds = 20;
constexpr double tukey = 4.685;      // 95 % efficient for a normal distribution
constexpr double least_alike = 0.7;  // cosine between the normals of partners
constexpr std::size_t fewest_pairs = 50;
constexpr std::size_t most_points = 12'000;

struct Pair {
  Eigen::Vector3d moved, fixed, normal;  ///< in BEFORE's world
  double off() const { return normal.dot(moved - fixed); }
};

SurfacePoints thinned(const TriangleMesh& mesh) {
  SurfacePoints all = surface_points(mesh), few;
  const std::size_t step = std::max<std::size_t>(1, (all.size() + most_points - 1) / most_points);
  for (std::size_t i = 0; i < all.size(); i += step) {
    few.positions.push_back(all.positions[i]);
    few.normals.push_back(all.normals[i]);
  }
  return few;
}

/// Each side's points with their nearest ones of the other.
std::vector<Pair> pairs_of(const SurfacePoints& after, const KdTree& after_tree,
                           const SurfacePoints& before, const KdTree& before_tree,
                           const Similarity3d& before_from_after, double reach) {
  const Similarity3d after_from_before = before_from_after.inverse();
  std::vector<Pair> pairs;
  std::size_t j = 0;
  double d2 = 0;
  const auto add = [&](std::size_t a, std::size_t b, bool before_plane) {
    const Eigen::Vector3d moved = before_from_after * after.positions[a],
                          normal = before_from_after.rotation * after.normals[a];
    if ((moved - before.positions[b]).norm() > reach ||
        !(normal.dot(before.normals[b]) > least_alike))
      return;
    pairs.push_back({moved, before.positions[b], before_plane ? before.normals[b] : normal});
  };
  for (std::size_t a = 0; a < after.size(); ++a)
    if (before_tree.nearest(before_from_after * after.positions[a], 1, &j, &d2) == 1)
      add(a, j, true);
  for (std::size_t b = 0; b < before.size(); ++b)
    if (after_tree.nearest(after_from_before * before.positions[b], 1, &j, &d2) == 1)
      add(j, b, false);
  return pairs;
}

double sigma_of(const std::vector<Pair>& pairs) {
  std::vector<double> off;
  for (const Pair& p : pairs) off.push_back(std::abs(p.off()));
  return sigma_of_median * median_in(off);
}

Eigen::Vector3d middle_of(const std::vector<Pair>& pairs) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Pair& p : pairs) middle += p.moved;
  return middle / static_cast<double>(pairs.size());
}

/// How a pair's distance changes with turn, scale and shift about the middle, in `unit`.
Vector7 slope(const Pair& p, const Eigen::Vector3d& middle, double unit) {
  const Eigen::Vector3d lever = (p.moved - middle) / unit;
  Vector7 j;
  j << lever.cross(p.normal), lever.dot(p.normal), p.normal;
  return j;
}

/// One Gauss-Newton step over turn, scale and shift about the pairs' middle; none where they leave
/// a direction open.
std::optional<Similarity3d> step(const std::vector<Pair>& pairs, double bound, double unit) {
  const Eigen::Vector3d middle = middle_of(pairs);
  Matrix7 normal_matrix = Matrix7::Zero();
  Vector7 right = Vector7::Zero();
  for (const Pair& p : pairs) {
    const double off = p.off() / unit, share = p.off() / bound;
    if (!(std::abs(share) < 1)) continue;
    const double weight = std::pow(1 - share * share, 2);
    const Vector7 j = slope(p, middle, unit);
    normal_matrix += weight * j * j.transpose();
    right -= weight * off * j;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix7> spectrum(normal_matrix);
  if (!(spectrum.eigenvalues()[0] > 1e-7 * spectrum.eigenvalues()[6])) return std::nullopt;
  const Vector7 x = normal_matrix.ldlt().solve(right);
  if (!x.allFinite()) return std::nullopt;
  Similarity3d update;
  update.rotation = turned_by(x.head<3>());
  update.scale = std::exp(x[3]);
  update.translation = middle + unit * x.tail<3>() - update.scale * (update.rotation * middle);
  return update;
}

/// One standard deviation of the scale at the end of the steps: the sandwich estimate over blocks
/// of space of that side. A field's depth is off alike over a whole wall, so that a block says one
/// thing, however many vertices it has.
double scale_sigma(const std::vector<Pair>& pairs, double bound, double unit, double block) {
  const Eigen::Vector3d middle = middle_of(pairs);
  Matrix7 curvature = Matrix7::Zero();
  std::map<std::array<long, 3>, Vector7> pulls;
  for (const Pair& p : pairs) {
    const double share = p.off() / bound, rest = 1 - share * share;
    if (!(rest > 0)) continue;
    const Vector7 j = slope(p, middle, unit);
    curvature += rest * (1 - 5 * share * share) * j * j.transpose();  // Tukey's second derivative
    const Eigen::Vector3d at = (p.moved - middle) / block;
    const std::array cell{std::lround(at.x()), std::lround(at.y()), std::lround(at.z())};
    pulls.try_emplace(cell, Vector7::Zero()).first->second += rest * rest * p.off() / unit * j;
  }
  const auto blocks = static_cast<double>(pulls.size());
  Matrix7 spread = Matrix7::Zero();
  for (const auto& [cell, pull] : pulls) spread += pull * pull.transpose();
  const Eigen::LDLT<Matrix7> solver(curvature);
  const Vector7 of_scale = solver.solve(Vector7::Unit(3));
  // The fit takes up as many of the blocks' contradictions as it has unknowns.
  const double freedom = std::max(1.0, blocks - 7);
  const double variance = blocks / freedom * of_scale.dot(spread * of_scale);
  return solver.isPositive() && std::isfinite(variance) ? std::sqrt(variance)
                                                        : std::numeric_limits<double>::infinity();
}

/// How far errors are shared is not known: the largest over blocks of several sizes.
double scale_sigma(const std::vector<Pair>& pairs, double bound, double unit) {
  double sigma = 0;
  for (const double block : {0.05, 0.1, 0.2, 0.3})
    sigma = std::max(sigma, scale_sigma(pairs, bound, unit, block * unit));
  return sigma;
}

/// The way most of a surface faces: up, where it holds the ground.
Eigen::Vector3d most_faced(const SurfacePoints& points) {
  constexpr std::size_t tried = 300;
  const double same_way = std::cos(15 * EIGEN_PI / 180);
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  std::size_t most = 0;
  const std::size_t step = std::max<std::size_t>(1, points.size() / tried);
  for (std::size_t t = 0; t < points.size(); t += step) {
    std::size_t count = 0;
    for (const Eigen::Vector3d& normal : points.normals)
      count += normal.dot(points.normals[t]) > same_way;
    if (count > most) most = count, best = points.normals[t];
  }
  return best;
}

/// Share of the points that lie within `reach` of the others' surface and face the same way. Those
/// that face as most of their own do count for nothing: level ground lies on any other.
double share_near(const SurfacePoints& points, const SurfacePoints& others, const KdTree& tree,
                  const Similarity3d& other_from_own, double reach) {
  const Eigen::Vector3d ground = most_faced(points);
  const double as_ground = std::cos(25 * EIGEN_PI / 180);
  std::size_t near = 0, counted = 0, j = 0;
  double d2 = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points.normals[i].dot(ground) > as_ground) continue;
    ++counted;
    near += tree.nearest(other_from_own * points.positions[i], 1, &j, &d2) == 1 &&
            d2 <= reach * reach &&
            (other_from_own.rotation * points.normals[i]).dot(others.normals[j]) > least_alike;
  }
  return counted < fewest_pairs ? 0 : static_cast<double>(near) / static_cast<double>(counted);
}

PointCloud cloud_of(const SurfacePoints& points) {
  PointCloud cloud;
  cloud.positions = points.positions;
  return cloud;
}

}  // namespace

Result<SurfaceRegistration> refine_surfaces(const TriangleMesh& after_mesh,
                                            const TriangleMesh& before_mesh,
                                            const Similarity3d& start,
                                            const ComparisonOptions& options) {
  const SurfacePoints after = thinned(after_mesh), before = thinned(before_mesh);
  constexpr const char* remedy = "see that both runs show one object, well reconstructed";
  if (after.size() < fewest_pairs || before.size() < fewest_pairs)
    return fail(ErrorKind::input, "the registration", "a surface without form", remedy);
  const KdTree after_tree(after.positions), before_tree(before.positions);
  const double unit = diagonal(before);
  SurfaceRegistration result;
  result.before_from_after = start;
  for (int round = 0; round < rounds; ++round) {
    const double progress = std::min(1.0, round / (0.6 * rounds));
    const double reach = unit * std::pow(start_reach, 1 - progress) * std::pow(end_reach, progress);
    const auto pairs =
        pairs_of(after, after_tree, before, before_tree, result.before_from_after, reach);
    if (pairs.size() < fewest_pairs)
      return fail(ErrorKind::input, "the registration",
                  fmt::format("{} places where both surfaces meet", pairs.size()), remedy);
    result.residual = sigma_of(pairs);
    const auto update = step(pairs, std::max(tukey * result.residual, 1e-6 * unit), unit);
    if (!update)
      return fail(ErrorKind::input, "the registration",
                  "surfaces on which one can slide along the other", remedy);
    result.before_from_after = *update * result.before_from_after;
    if (round == rounds - 1)
      result.scale_sigma = scale_sigma(pairs, std::max(tukey * result.residual, 1e-6 * unit), unit);
  }
  const Similarity3d& moved = result.before_from_after;
  const double reach = options.overlap_distance * unit;
  result.overlap =
      std::min(share_near(after, before, before_tree, moved, reach),
               share_near(before, after, after_tree, moved.inverse(), reach / moved.scale));
  return result;
}

Result<SurfaceRegistration> register_surfaces(const TriangleMesh& after, const TriangleMesh& before,
                                              const ViewScore& view_score,
                                              const ComparisonOptions& options,
                                              const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  RegistrationOptions search;
  search.estimate_warp = false;  // two runs by one kind of camera: what is bent is noise or change
  ORBITFUSE_ASSIGN(const RegistrationReport clouds,
                   register_clouds(cloud_of(surface_points(after)),
                                   cloud_of(surface_points(before)), search, progress, view_score));
  ORBITFUSE_ASSIGN(SurfaceRegistration result,
                   refine_surfaces(after, before, clouds.target_from_source, options));
  result.clouds = clouds;
  if (result.overlap < options.least_overlap)
    return fail(
        ErrorKind::quality, "the registration",
        fmt::format(
            "{:.0f} % of what stands on the ground lies on the other's, {:.0f} % are needed",
            100 * result.overlap, 100 * options.least_overlap),
        "compare two runs of one object");
  return result;
}

}  // namespace orbitfuse::comparison
