// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tests/support/box_scene.hpp"
#include "tests/support/orbit_fixture.hpp"

namespace orbitfuse::testing_orbit {

/// Half an orbit of thermal views in a world of their own.
struct ThermalOrbit {
  Similarity3d visible_from_thermal{
      0.4,
      Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, -2, 0.5).normalized())),
      {3, -1, 2}};
  std::vector<PosedView> views;
  std::vector<cv::Mat> images;

  explicit ThermalOrbit(double apart_deg = 35) {
    const Camera camera = testing_orbit::camera(1000).scaled_to(320, 240);
    for (int i = 0; i < 6; ++i) {
      OrbitPose pose;
      pose.azimuth_deg = apart_deg * i, pose.elevation_deg = i % 2 == 0 ? 12 : 25,
      pose.radius = 2.5;
      const Rigid3d in_visible = cam_from_world_of(pose, camera);
      images.push_back(box_view(camera, in_visible, true).brightness);
      views.push_back({"view", camera, rebase(in_visible, visible_from_thermal.inverse())});
    }
  }
};

}  // namespace orbitfuse::testing_orbit
