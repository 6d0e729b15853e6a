// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/transform.hpp"

namespace orbitfuse {

Rigid3d cam_from_world_of_opengl(const Eigen::Matrix4d& world_from_cam_gl) {
  Eigen::Matrix3d world_from_cam = world_from_cam_gl.topLeftCorner<3, 3>();
  world_from_cam.col(1) *= -1.0;
  world_from_cam.col(2) *= -1.0;
  Rigid3d pose;
  pose.rotation = Eigen::Quaterniond(world_from_cam).normalized();
  pose.translation = world_from_cam_gl.topRightCorner<3, 1>();
  return pose.inverse();
}

Eigen::Matrix4d opengl_of_cam_from_world(const Rigid3d& cam_from_world) {
  Eigen::Matrix4d m = cam_from_world.inverse().matrix();
  m.col(1) *= -1.0;
  m.col(2) *= -1.0;
  return m;
}

}  // namespace orbitfuse
