// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/ground/ground_plane.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/geometry/level_cameras.hpp"

namespace orbitfuse::depth {
namespace {

constexpr int sample_step_px = 4;
constexpr std::size_t least_depths = 1000;
/// Of the scene radius: gravel, grass and the depth's own error.
constexpr double thickness = 0.015;
/// An operator holds the camera upright to this.
constexpr double max_tilt_deg = 31.7;
/// Where a tenth of the points lie on it, one triple in a thousand does.
constexpr int trials = 5000;
/// A ground is a good part of what is seen; a table top or a platform's roof is less, and has
/// something below it.
constexpr double min_share = 0.1, max_below = 0.03;
constexpr double min_camera_height = 0.03;
/// Below this share of their sum views look up in ways that contradict each other.
constexpr float min_common_up = 0.3f;
/// A ground goes on under the cameras: of the directions in which it is confirmed beyond
/// `near_radius`, so many reach `under_cameras`. A table or a turntable ends before. A third of an
/// orbit sees a third of them.
constexpr double near_radius = 0.3, under_cameras = 0.9, min_reaching = 0.2;
constexpr int sectors = 36;

std::vector<Eigen::Vector3d> confirmed_points(const std::vector<DepthView>& views,
                                              const std::vector<DepthMap>& maps) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (int y = 0; y < maps[i].depth.rows; y += sample_step_px)
      for (int x = 0; x < maps[i].depth.cols; x += sample_step_px)
        if (const float z = maps[i].depth.at<float>(y, x); std::isfinite(z))
          points.push_back(world_of(views[i], {x + 0.5, y + 0.5}, z).cast<double>());
  return points;
}

std::optional<Eigen::Vector3d> common_up(const std::vector<DepthView>& views) {
  std::vector<Rigid3d> cameras;
  for (const DepthView& view : views)
    cameras.push_back({Eigen::Quaterniond(view.world_rotation.cast<double>().eval()),
                       view.translation.cast<double>()});
  if (held_on_side(cameras)) return up_direction(cameras);
  Eigen::Vector3f up = Eigen::Vector3f::Zero();
  for (const DepthView& view : views) up -= view.world_rotation.row(1).transpose();
  if (!(up.norm() > min_common_up * static_cast<float>(views.size()))) return std::nullopt;
  return up.normalized().cast<double>();
}

/// Of the directions round the centre in which points of the plane lie, the share in which they
/// reach as far out as the cameras.
double reaching_share(const std::vector<Eigen::Vector3d>& on_plane, const LevelPlane& plane) {
  const Eigen::Vector3d x = plane.normal.unitOrthogonal(), y = plane.normal.cross(x);
  std::array<bool, sectors> near{}, far{};
  for (const Eigen::Vector3d& p : on_plane) {
    const double radius = std::hypot(p.dot(x), p.dot(y));
    const double turns = std::atan2(p.dot(y), p.dot(x)) / (2 * std::numbers::pi) + 0.5;
    const auto sector = static_cast<std::size_t>(turns * sectors) % sectors;
    near[sector] = near[sector] || radius > near_radius;
    far[sector] = far[sector] || radius > under_cameras;
  }
  const auto all = std::count(near.begin(), near.end(), true);
  return all > 0 ? static_cast<double>(std::count(far.begin(), far.end(), true)) /
                       static_cast<double>(all)
                 : 0;
}

bool under_the_cameras(const LevelPlane& plane, const std::vector<DepthView>& views) {
  return std::all_of(views.begin(), views.end(), [&](const DepthView& view) {
    return plane.above(view.center().cast<double>()) > min_camera_height;
  });
}

tl::unexpected<Error> no_ground(std::string found) {
  return fail(ErrorKind::quality, "ground", std::move(found), "depth is not extended");
}

}  // namespace

Result<LevelPlane> find_ground(const std::vector<DepthView>& views,
                               const std::vector<DepthMap>& maps, std::uint64_t seed) {
  const std::vector<Eigen::Vector3d> points = confirmed_points(views, maps);
  if (points.size() < least_depths)
    return no_ground(fmt::format("{} confirmed depths", points.size()));
  const auto up = common_up(views);
  if (!up) return no_ground("the views disagree about what is up");
  const auto plane = largest_level_plane(
      points, *up,
      {.max_tilt_deg = max_tilt_deg,
       .band = thickness,
       .trials = trials,
       .seed = seed,
       .admissible = [&](const LevelPlane& tried) { return under_the_cameras(tried, views); }});
  if (!plane || !under_the_cameras(*plane, views)) return no_ground("no plane under all cameras");
  const auto all = static_cast<double>(points.size());
  const std::vector<Eigen::Vector3d> ground = in_plane(points, *plane, thickness);
  const double on = static_cast<double>(ground.size()) / all;
  const double below = static_cast<double>(std::count_if(
                           points.begin(), points.end(),
                           [&](const auto& x) { return plane->above(x) < -3 * thickness; })) /
                       all;
  if (!(on > min_share) || below > max_below)
    return no_ground(fmt::format("{:.1f} % of the depths on the largest plane, {:.1f} % below it",
                                 100 * on, 100 * below));
  if (const double reaching = reaching_share(ground, *plane); !(reaching >= min_reaching))
    return no_ground(
        fmt::format("the largest plane ends before the cameras: it reaches as far out "
                    "in {:.0f} % of its directions, as a table would",
                    100 * reaching));
  return *plane;
}

}  // namespace orbitfuse::depth
