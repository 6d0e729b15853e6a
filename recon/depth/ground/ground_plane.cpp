// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/ground/ground_plane.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace orbitfuse::depth {
namespace {

constexpr int sample_step_px = 4;
constexpr std::size_t least_depths = 1000;
/// Of the scene radius: gravel, grass and the depth's own error.
constexpr double thickness = 0.015;
/// An operator holds the camera upright to this.
constexpr double max_tilt_deg = 31.7;
constexpr int trials = 400;
/// A ground is a good part of what is seen; a table top or a platform's roof is less, and has
/// something below it.
constexpr double min_share = 0.1, max_below = 0.03;
constexpr double min_camera_height = 0.03;

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

Eigen::Vector3d mean_up(const std::vector<DepthView>& views) {
  Eigen::Vector3f up = Eigen::Vector3f::Zero();
  for (const DepthView& view : views) up -= view.world_rotation.row(1).transpose();
  return up.normalized().cast<double>();
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
  const auto plane = largest_level_plane(
      points, mean_up(views),
      {.max_tilt_deg = max_tilt_deg,
       .band = thickness,
       .trials = trials,
       .seed = seed,
       .admissible = [&](const LevelPlane& tried) { return under_the_cameras(tried, views); }});
  if (!plane || !under_the_cameras(*plane, views)) return no_ground("no plane under all cameras");
  const auto all = static_cast<double>(points.size());
  const double on = static_cast<double>(in_plane(points, *plane, thickness).size()) / all;
  const double below = static_cast<double>(std::count_if(
                           points.begin(), points.end(),
                           [&](const auto& x) { return plane->above(x) < -3 * thickness; })) /
                       all;
  if (!(on > min_share) || below > max_below)
    return no_ground(fmt::format("{:.1f} % of the depths on the largest plane, {:.1f} % below it",
                                 100 * on, 100 * below));
  return *plane;
}

}  // namespace orbitfuse::depth
