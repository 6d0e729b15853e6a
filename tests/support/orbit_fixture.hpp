// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>

#include "core/geometry/reconstruction.hpp"
#include "recon/poses/cross_modal/orbit_search.hpp"

namespace orbitfuse::testing_orbit {

inline Camera camera(double focal = 600) {
  Camera c;
  c.width = 640, c.height = 480;
  c.fx = c.fy = focal, c.cx = 320, c.cy = 240;
  return c;
}

/// Cameras every 30 deg in two loops about the origin.
inline std::vector<PosedView> two_loops(double radius = 4) {
  std::vector<PosedView> views;
  for (int i = 0; i < 24; ++i) {
    OrbitPose pose;
    pose.azimuth_deg = 30.0 * (i % 12) + 3.0 * ((i * 7) % 3 - 1);
    pose.elevation_deg = i < 12 ? 14 : 34;
    pose.radius = radius;
    views.push_back({"view" + std::to_string(i), camera(), cam_from_world_of(pose, camera())});
  }
  return views;
}

/// Points in a cube, seen by every camera that has them in front.
inline Reconstruction seen_cube(const std::vector<PosedView>& views, int count, double noise_px,
                                unsigned seed = 1, bool flat = false) {
  Reconstruction model;
  model.views = views;
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> place(-0.8, 0.8);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int i = 0; i < count; ++i) {
    SparsePoint point;
    point.position = {place(rng), place(rng), flat ? 0.0 : place(rng)};
    for (std::size_t v = 0; v < views.size(); ++v) {
      const Eigen::Vector2d p = views[v].camera.project(views[v].cam_from_world * point.position);
      if (!p.allFinite() || p.x() < 0 || p.y() < 0 || p.x() >= 640 || p.y() >= 480) continue;
      point.track.push_back(
          {static_cast<int>(v), p + noise_px * Eigen::Vector2d(noise(rng), noise(rng))});
    }
    if (point.track.size() >= 2) model.points.push_back(point);
  }
  return model;
}

}  // namespace orbitfuse::testing_orbit
