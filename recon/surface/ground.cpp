// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/ground.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
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
  const auto plane = largest_level_plane(
      samples, up, {.max_tilt_deg = level_deg, .band = band, .trials = planes_tried});
  if (!plane) return std::nullopt;
  GroundPlane ground{*plane};
  const auto below = std::count_if(middles.all.begin(), middles.all.end(),
                                   [&](const auto& p) { return ground.above(p) < -3 * band; });
  if (static_cast<double>(below) > most_below * static_cast<double>(middles.all.size()))
    return std::nullopt;
  const auto near = in_plane(samples, ground, 3 * band);
  if (!goes_on_all_round(near, box, ground.normal)) return std::nullopt;
  std::vector<double> off;
  for (const Eigen::Vector3d& p : near) off.push_back(std::abs(ground.above(p)));
  ground.sigma = sigma_of_median * median(off);
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
