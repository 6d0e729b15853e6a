// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

// A transform's name is its type: x_in_cam = cam_from_world * x_in_world; neighbours match.
namespace orbitfuse {

/// Rotation then translation: y = R x + t.
struct Rigid3d {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3d inverse() const {
    const Eigen::Quaterniond q = rotation.conjugate();
    return {q, -(q * translation)};
  }
  Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
    m.topRightCorner<3, 1>() = translation;
    return m;
  }
  bool is_finite() const { return rotation.coeffs().allFinite() && translation.allFinite(); }
};

inline Eigen::Vector3d operator*(const Rigid3d& a_from_b, const Eigen::Vector3d& x_in_b) {
  return a_from_b.rotation * x_in_b + a_from_b.translation;
}
inline Rigid3d operator*(const Rigid3d& a_from_b, const Rigid3d& b_from_c) {
  return {(a_from_b.rotation * b_from_c.rotation).normalized(),
          a_from_b.rotation * b_from_c.translation + a_from_b.translation};
}

/// y = s R x + t, s > 0.
struct Similarity3d {
  double scale = 1.0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Similarity3d inverse() const {
    const Eigen::Quaterniond q = rotation.conjugate();
    return {1.0 / scale, q, -(q * translation) / scale};
  }
  Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = scale * rotation.toRotationMatrix();
    m.topRightCorner<3, 1>() = translation;
    return m;
  }
  bool is_finite() const {
    return std::isfinite(scale) && rotation.coeffs().allFinite() && translation.allFinite();
  }
};

inline Eigen::Vector3d operator*(const Similarity3d& a_from_b, const Eigen::Vector3d& x_in_b) {
  return a_from_b.scale * (a_from_b.rotation * x_in_b) + a_from_b.translation;
}
inline Similarity3d operator*(const Similarity3d& a_from_b, const Similarity3d& b_from_c) {
  return {a_from_b.scale * b_from_c.scale, (a_from_b.rotation * b_from_c.rotation).normalized(),
          a_from_b.scale * (a_from_b.rotation * b_from_c.translation) + a_from_b.translation};
}

/// The camera pose after its world moved by a similarity: cam_from_b for b_from_a.
/// Depths in the camera grow by the scale; pixels do not change.
inline Rigid3d rebase(const Rigid3d& cam_from_a, const Similarity3d& b_from_a) {
  const Eigen::Quaterniond q = (cam_from_a.rotation * b_from_a.rotation.conjugate()).normalized();
  return {q, b_from_a.scale * cam_from_a.translation - q * b_from_a.translation};
}

inline Eigen::Vector3d camera_center(const Rigid3d& cam_from_world) {
  return -(cam_from_world.rotation.conjugate() * cam_from_world.translation);
}

/// Angle of the rotation between two orientations, degrees in [0, 180].
inline double rotation_angle_deg(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.angularDistance(b) * 180.0 / 3.14159265358979323846;
}

/// OpenGL camera-to-world (x right, y up, looks along -z; nerfstudio, ground_truth.json) to
/// cam_from_world with OpenCV/COLMAP camera axes (x right, y down, looks along +z), and back.
Rigid3d cam_from_world_of_opengl(const Eigen::Matrix4d& world_from_cam_gl);
Eigen::Matrix4d opengl_of_cam_from_world(const Rigid3d& cam_from_world);

}  // namespace orbitfuse
