// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "recon/nerf/field/ray.hpp"
#include "recon/nerf/field/ray_numbers.hpp"
#include "recon/nerf/field/space.hpp"

namespace orbitfuse::nerf {

/// Rays of one camera. Lens distortion is inverted once on a lattice of pixels and interpolated:
/// the inverse iterates, and over 8 px it is straight to about 0.01 px.
class ViewRays {
 public:
  ViewRays() = default;
  ViewRays(const Camera& camera, const Rigid3d& cam_from_world, const Space& space);

  /// Through pixel coordinates (x, y), as in Camera. False outside the lens model's valid field.
  bool ray(double x, double y, Ray& out) const;
  /// Pixel and z depth (normalised units) of a normalised point; false behind the camera.
  bool project(const float point[3], double& x, double& y, double& depth) const;
  /// What lies at a distance (normalised units) on that ray, in camera axes from the camera.
  Eigen::Vector3d in_camera(double x, double y, double distance) const;
  /// Rays of the same camera from elsewhere, equal to those of a new object there.
  void place(const Rigid3d& cam_from_world, const Space& space);
  /// Where the camera is when the scene seen from here is turned by `turn` (axis times radians) and
  /// then shifted, both in camera axes and normalised units.
  Rigid3d moved(const Eigen::Vector3d& shift, const Eigen::Vector3d& turn,
                const Space& space) const;
  /// Angle of one pixel, radians.
  float pixel_angle() const { return pixel_angle_; }
  const Camera& camera() const { return camera_; }
  const Eigen::Vector3d& origin() const { return origin_; }
  RayNumbers numbers() const;
  const float* lattice() const;  ///< as RayNumbers describes it; null: there is none

 private:
  Eigen::Vector3d through(double x, double y) const;  ///< in camera axes, z = 1

  Camera camera_;
  Eigen::Matrix3d world_from_cam_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  float pixel_angle_ = 0;
  int lattice_width_ = 0;
  std::vector<Eigen::Vector2f>
      lattice_;  ///< normalised coordinates every 8 px; empty: no distortion
};

}  // namespace orbitfuse::nerf
