// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/ground.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {

constexpr double level_deg = 15, facing_deg = 30;
constexpr double band_share = 0.0075;  // of the box's side: what counts as in the plane
constexpr std::size_t most_samples = 20'000;
constexpr int planes_tried = 300;
// The ground goes on beyond what stands on it: it is met in the outer part of the box all round.
constexpr int sectors = 36;
constexpr double outer_share = 0.38, least_sectors = 0.6;
// Of the mesh's triangles: what may lie below, as a field's floaters do.
constexpr double most_below = 0.05;

double cosine(double deg) { return std::cos(deg * std::numbers::pi / 180); }

struct Middles {
  std::vector<Eigen::Vector3d> all, upward;
};

Middles middles_of(const TriangleMesh& mesh, const Eigen::Vector3d& up) {
  Middles result;
  const auto& p = mesh.vertices.positions;
  const std::size_t step = std::max<std::size_t>(1, mesh.triangles.size() / (4 * most_samples));
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const auto& t = mesh.triangles[i];
    const Eigen::Vector3d normal = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
    const Eigen::Vector3d middle = (p[t[0]] + p[t[1]] + p[t[2]]) / 3;
    if (!(normal.norm() > 0) || !middle.allFinite()) continue;
    result.all.push_back(middle);
    if (normal.normalized().dot(up) > cosine(facing_deg)) result.upward.push_back(middle);
  }
  return result;
}

std::vector<Eigen::Vector3d> in_band(const std::vector<Eigen::Vector3d>& points,
                                     const GroundPlane& plane, double band) {
  std::vector<Eigen::Vector3d> near;
  for (const Eigen::Vector3d& p : points)
    if (std::abs(plane.above(p)) <= band) near.push_back(p);
  return near;
}

std::optional<GroundPlane> level_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& point,
                                       const Eigen::Vector3d& up) {
  GroundPlane plane;
  plane.normal = normal.dot(up) < 0 ? -normal : normal;
  plane.height = plane.normal.dot(point);
  if (!(plane.normal.dot(up) > cosine(level_deg))) return std::nullopt;
  return plane;
}

std::optional<GroundPlane> fitted(const std::vector<Eigen::Vector3d>& points,
                                  const Eigen::Vector3d& up) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) middle += p;
  middle /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - middle) * (p - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  return level_plane(axes.eigenvectors().col(0), middle, up);
}

std::optional<GroundPlane> largest_plane(const std::vector<Eigen::Vector3d>& points, double band,
                                         const Eigen::Vector3d& up) {
  if (points.size() < 100) return std::nullopt;
  std::mt19937 random(1);
  const auto any = [&] { return points[random() % points.size()]; };
  std::optional<GroundPlane> best;
  std::size_t most = 0;
  for (int i = 0; i < planes_tried; ++i) {
    const Eigen::Vector3d a = any(), b = any(), c = any();
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > band * band)) continue;
    const auto plane = level_plane(normal.normalized(), a, up);
    if (!plane) continue;
    const auto count =
        static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [&](const auto& p) {
          return std::abs(plane->above(p)) <= band;
        }));
    if (count > most) {
      most = count;
      best = plane;
    }
  }
  for (int i = 0; i < 3 && best; ++i) {
    const auto near = in_band(points, *best, band);
    if (near.size() < 100) return std::nullopt;
    best = fitted(near, up);
  }
  return best;
}

bool goes_on_all_round(const std::vector<Eigen::Vector3d>& points, const Eigen::AlignedBox3d& box,
                       const Eigen::Vector3d& normal) {
  const Eigen::Vector3d x = normal.unitOrthogonal(), y = normal.cross(x);
  std::vector<bool> met(sectors, false);
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d from = p - box.center();
    const double u = from.dot(x), v = from.dot(y);
    if (std::hypot(u, v) < outer_share * box.sizes().maxCoeff()) continue;
    const double turn = std::atan2(v, u) / (2 * std::numbers::pi) + 0.5;
    met[static_cast<std::size_t>(std::min(sectors - 1.0, turn * sectors))] = true;
  }
  return static_cast<double>(std::count(met.begin(), met.end(), true)) >= least_sectors * sectors;
}

}  // namespace

std::optional<GroundPlane> find_ground(const TriangleMesh& mesh, const Eigen::AlignedBox3d& box,
                                       const Eigen::Vector3d& up) {
  Middles middles = middles_of(mesh, up);
  std::vector<Eigen::Vector3d> samples;
  const std::size_t step = std::max<std::size_t>(1, middles.upward.size() / most_samples);
  for (std::size_t i = 0; i < middles.upward.size(); i += step)
    samples.push_back(middles.upward[i]);
  const double band = band_share * box.sizes().maxCoeff();
  std::optional<GroundPlane> ground = largest_plane(samples, band, up);
  if (!ground) return std::nullopt;
  const auto below = std::count_if(middles.all.begin(), middles.all.end(),
                                   [&](const auto& p) { return ground->above(p) < -3 * band; });
  if (static_cast<double>(below) > most_below * static_cast<double>(middles.all.size()))
    return std::nullopt;
  const auto near = in_band(samples, *ground, 3 * band);
  if (!goes_on_all_round(near, box, ground->normal)) return std::nullopt;
  std::vector<double> off;
  for (const Eigen::Vector3d& p : near) off.push_back(std::abs(ground->above(p)));
  ground->sigma = 1.4826 * median(off);
  return ground;
}

TriangleMesh without_ground(const TriangleMesh& mesh, const GroundPlane& ground, double clearance) {
  TriangleMesh result;
  result.vertices = mesh.vertices;
  for (const auto& t : mesh.triangles)
    if (std::any_of(t.begin(), t.end(), [&](std::uint32_t v) {
          return ground.above(mesh.vertices.positions[v]) >= clearance;
        }))
      result.triangles.push_back(t);
  return result;
}

}  // namespace orbitfuse
