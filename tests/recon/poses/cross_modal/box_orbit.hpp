// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/scene_renderer.hpp"
#include "recon/poses/cross_modal/orbit_search.hpp"
#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

// Two loops of eight thermal views about one box, or about two that together are not their own
// mirror image.
namespace orbitfuse::testing_orbit {

constexpr double box_orbit_radius = 2.5;

/// Where a second box of the same form stands, on one side of the first, which alone is its own
/// mirror image.
const Rigid3d second_from_first{
    Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())), {0.1, -0.55, 0.05}};

inline SceneRender boxes_view(const Camera& camera, const Rigid3d& cam_from_world, bool hot,
                              bool both) {
  SceneRender seen = box_view(camera, cam_from_world, hot);
  if (!both) return seen;
  const SceneRender other = box_view(camera, cam_from_world * second_from_first, hot);
  const cv::Mat nearer =
      (other.depth == other.depth) & ((seen.depth != seen.depth) | (other.depth < seen.depth));
  other.brightness.copyTo(seen.brightness, nearer);
  other.depth.copyTo(seen.depth, nearer);
  return seen;
}

/// The edges of each box, seen from everywhere.
inline LineModel box_lines(bool both) {
  std::vector<Eigen::Vector3d> centers;
  for (int i = 0; i < 12; ++i)
    for (const double z : {0.3, 1.2}) {
      const double a = i * std::numbers::pi / 6;
      centers.emplace_back(box_orbit_radius * std::cos(a), box_orbit_radius * std::sin(a), z);
    }
  std::vector<int> all(centers.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<EdgeLine> lines;
  const auto add = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    for (int corner = 0; corner < 8; ++corner)
      for (int axis = 0; axis < 3; ++axis) {
        if ((corner >> axis & 1) != 0) continue;
        Eigen::Vector3d a;
        for (int k = 0; k < 3; ++k) a[k] = (corner >> k & 1) != 0 ? high[k] : low[k];
        Eigen::Vector3d b = a;
        b[axis] = high[axis];
        lines.push_back({a, b, all});
        if (both) lines.push_back({second_from_first * a, second_from_first * b, all});
      }
  };
  add({-0.4, -0.15, -0.15}, {0.4, 0.15, 0.15});
  add({0.2, -0.1, 0.15}, {0.35, 0.1, 0.27});
  return {lines, centers};
}

struct BoxOrbit {
  Camera camera;
  std::vector<Station> stations;
  std::vector<Rigid3d> poses;
  std::vector<cv::Mat> images;
};

/// Views begin 20 degrees after the world's x axis, which no station says.
inline BoxOrbit box_orbit(bool both, int width = 320) {
  BoxOrbit orbit;
  orbit.camera = camera(1000).scaled_to(width, width * 3 / 4);
  orbit.camera.cx += width / 80.0, orbit.camera.cy -= width / 100.0;
  for (int i = 0; i < 16; ++i) {
    Station station;
    station.loop = i / 8, station.azimuth_deg = 45.0 * (i % 8);
    OrbitPose pose;
    pose.azimuth_deg = station.azimuth_deg + 20 + (i % 2 == 0 ? 3 : -3);
    pose.elevation_deg = i < 8 ? 12 : 28, pose.radius = box_orbit_radius;
    orbit.stations.push_back(station);
    orbit.poses.push_back(cam_from_world_of(pose, orbit.camera));
    orbit.images.push_back(boxes_view(orbit.camera, orbit.poses.back(), true, both).brightness);
  }
  return orbit;
}

inline SceneRenderer boxes_renderer(bool both) {
  return [both](const Camera& camera, const Rigid3d& pose) -> Result<SceneRender> {
    return boxes_view(camera, pose, false, both);
  };
}

}  // namespace orbitfuse::testing_orbit
