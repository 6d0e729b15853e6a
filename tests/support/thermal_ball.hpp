// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/image/undistorted.hpp"
#include "recon/poses/cross_modal/thermal_bundle.hpp"
#include "tests/support/orbit_fixture.hpp"

// Thermal views of a ball on a floor, with exact poses.
namespace orbitfuse::testing_orbit {

/// A ball on a floor. Both cameras see its stripes and its outline, the thermal one temperatures
/// that vary over the surface besides.
inline SceneRender ball_view(const Camera& camera, const Rigid3d& cam_from_world, bool hot) {
  SceneRender view{cv::Mat(camera.height, camera.width, CV_32F, cv::Scalar(0)),
                   cv::Mat(camera.height, camera.width, CV_32F,
                           cv::Scalar(std::numeric_limits<float>::quiet_NaN()))};
  const Rigid3d world_from_cam = cam_from_world.inverse();
  const Eigen::Vector3d origin = world_from_cam.translation;
  constexpr double radius = 0.45, floor_z = -0.4;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = world_from_cam.rotation * camera.ray_of({x + 0.5, y + 0.5});
      double depth = (floor_z - origin.z()) / ray.z();
      const double a = ray.squaredNorm(), b = origin.dot(ray),
                   root = b * b - a * (origin.squaredNorm() - radius * radius);
      if (root > 0) depth = (-b - std::sqrt(root)) / a;
      if (!(depth > 0)) continue;
      const Eigen::Vector3d p = origin + depth * ray;
      if (p.head<2>().norm() > 1.2) continue;
      view.depth.at<float>(y, x) = static_cast<float>(depth);
      const double form = (root > 0 ? 2.0 : 0.5) + (std::fmod(p.x() + 10, 0.3) < 0.15 ? 0.7 : 0);
      const double heat = std::sin(23 * p.x() + 5 * p.y()) + std::sin(19 * p.y() - 11 * p.z()) +
                          std::sin(17 * p.z() + 13 * p.x());
      view.brightness.at<float>(y, x) = static_cast<float>(hot ? 0.4 * heat - form : form);
    }
  return view;
}

struct Ball {
  SceneRenderer form = [](const Camera& camera, const Rigid3d& pose) -> Result<SceneRender> {
    return ball_view(camera, pose, false);
  };
  OrbitViews orbit;
  std::vector<PosedView> truth;
  Fit alignment;
  Progress progress;

  explicit Ball(int stations = 12) {
    const Camera lens = testing_orbit::camera(1000).scaled_to(320, 240);
    for (int i = 0; i < stations; ++i) {
      OrbitPose pose;
      pose.azimuth_deg = 30 * i, pose.elevation_deg = i % 2 == 0 ? 20 : 32, pose.radius = 2.5;
      truth.push_back({"view" + std::to_string(i), lens, cam_from_world_of(pose, lens)});
      orbit.images.push_back(ball_view(lens, truth.back().cam_from_world, true).brightness);
      orbit.stations.push_back({});
      alignment.views.push_back({truth.back(), 0.3, 100, 0.5, {}, {}});
    }
    alignment.focal_px = lens.fx;
  }

  /// Every camera nearer by a share, its focal length shorter by the same: the images hardly tell.
  void shorten(double share, double turned_deg) {
    std::mt19937 rng(3);
    std::normal_distribution<double> noise(0, turned_deg * 3.14159265358979 / 180);
    for (RenderAlignedView& view : alignment.views) {
      Rigid3d& pose = view.view.cam_from_world;
      pose.translation *= 1 - share;
      const Rigid3d turn{
          Eigen::Quaterniond(Eigen::AngleAxisd(noise(rng), Eigen::Vector3d::UnitX()) *
                             Eigen::AngleAxisd(noise(rng), Eigen::Vector3d::UnitY())),
          Eigen::Vector3d::Zero()};
      pose = turn * pose;
      view.view.camera.fx *= 1 - share, view.view.camera.fy *= 1 - share;
    }
    alignment.focal_px *= 1 - share;
  }

  /// As a lens with this k1 shows them.
  void bend(double k1) {
    for (std::size_t i = 0; i < truth.size(); ++i) {
      Camera bent = truth[i].camera;
      bent.k1 = k1;
      orbit.images[i] = undistorted(orbit.images[i], truth[i].camera, bent);
    }
  }

  Status bundle(double radial_sigma = 0) {
    return bundle_thermal({form, orbit, progress}, {alignment.focal_px, 0.03, radial_sigma}, {},
                          alignment);
  }
  double center_error(std::size_t i) const {
    return (camera_center(alignment.views[i].view.cam_from_world) -
            camera_center(truth[i].cam_from_world))
        .norm();
  }
  double focal_error() const { return alignment.focal_px / truth.front().camera.fx - 1; }
};

}  // namespace orbitfuse::testing_orbit
