// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/transform.hpp"

#include <gtest/gtest.h>

namespace orbitfuse {
namespace {

TEST(Transform, RebaseKeepsWhatTheCameraSees) {
  const Rigid3d cam_from_a{Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized(), {1, -2, 3}};
  const Similarity3d b_from_a{
      2.5, Eigen::Quaterniond(0.1, 0.9, -0.3, 0.2).normalized(), {4, 5, -6}};
  const Eigen::Vector3d x_in_a(0.3, 0.8, -1.2);
  const Eigen::Vector3d in_cam_a = cam_from_a * x_in_a;
  const Eigen::Vector3d in_cam_b = rebase(cam_from_a, b_from_a) * (b_from_a * x_in_a);
  EXPECT_LT((in_cam_b - 2.5 * in_cam_a).norm(), 1e-12);
}

TEST(Transform, InverseAndCompositionAgree) {
  const Similarity3d a{0.5, Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized(), {1, -2, 3}};
  const Similarity3d b{3.0, Eigen::Quaterniond(0.7, 0.1, 0.2, -0.7).normalized(), {0, 2, 9}};
  const Eigen::Vector3d x(0.1, 0.2, 0.3);
  EXPECT_LT((a * (b * x) - (a * b) * x).norm(), 1e-12);
  EXPECT_LT((a.inverse() * (a * x) - x).norm(), 1e-12);
}

TEST(Transform, OpenGlRoundTrip) {
  const Rigid3d cam_from_world{Eigen::Quaterniond(0.3, -0.5, 0.2, 0.7).normalized(), {1, -2, 3}};
  const Eigen::Matrix4d gl = opengl_of_cam_from_world(cam_from_world);
  // An OpenGL camera looks along its -z, ours along +z: the viewing directions must be equal.
  EXPECT_LT(
      (-gl.col(2).head<3>() - cam_from_world.inverse().rotation * Eigen::Vector3d::UnitZ()).norm(),
      1e-12);
  const Rigid3d back = cam_from_world_of_opengl(gl);
  EXPECT_LT(rotation_angle_deg(back.rotation, cam_from_world.rotation), 1e-6);
  EXPECT_LT((back.translation - cam_from_world.translation).norm(), 1e-12);
}

}  // namespace
}  // namespace orbitfuse
