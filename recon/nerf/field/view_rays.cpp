// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field/view_rays.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/rotation_vector.hpp"
#include "core/numeric/bilinear.hpp"

namespace orbitfuse::nerf {
ViewRays::ViewRays(const Camera& camera, const Rigid3d& cam_from_world, const Space& space)
    : camera_(camera), pixel_angle_(static_cast<float>(2.0 / (camera.fx + camera.fy))) {
  place(cam_from_world, space);
  if (!camera.has_distortion()) return;
  lattice_width_ = camera.width / lattice_px + 2;
  const int height = camera.height / lattice_px + 2;
  lattice_.reserve(static_cast<std::size_t>(lattice_width_ * height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < lattice_width_; ++x) {
      // Lattice nodes beyond the image border are clamped: outside it the model may not invert.
      const Eigen::Vector2d pixel(std::min(x * lattice_px, camera.width),
                                  std::min(y * lattice_px, camera.height));
      lattice_.push_back(camera.normalized_of(pixel).cast<float>());
    }
}

Eigen::Vector3d ViewRays::through(double px, double py) const {
  if (lattice_.empty())
    return {(px - camera_.cx) / camera_.fx, (py - camera_.cy) / camera_.fy, 1.0};
  const int ix = std::clamp(static_cast<int>(px) / lattice_px, 0, lattice_width_ - 2);
  const int rows = static_cast<int>(lattice_.size()) / lattice_width_;
  const int iy = std::clamp(static_cast<int>(py) / lattice_px, 0, rows - 2);
  const auto fraction = [](double p, int i, int limit) {
    const double low = std::min(i * lattice_px, limit);
    const double high = std::min((i + 1) * lattice_px, limit);
    return high > low ? static_cast<float>((p - low) / (high - low)) : 0.0f;
  };
  // Not place_among(): the lattice's last step is as short as the picture leaves it.
  const BilinearPlace<float> place{
      ix, iy, ix + 1, iy + 1, fraction(px, ix, camera_.width), fraction(py, iy, camera_.height)};
  const Eigen::Vector2f n = blended(place, [&](int y, int x) -> const Eigen::Vector2f& {
    return lattice_[static_cast<std::size_t>(y * lattice_width_ + x)];
  });
  return {n.x(), n.y(), 1.0};
}

bool ViewRays::ray(double x, double y, Ray& out) const {
  Eigen::Vector3d d = through(x, y);
  if (!d.allFinite()) return false;
  const double length = d.norm();
  out.forward = static_cast<float>(1.0 / length);
  d = world_from_cam_ * (d / length);
  for (int i = 0; i < 3; ++i) {
    out.origin[i] = static_cast<float>(origin_[i]);
    out.direction[i] = static_cast<float>(d[i]);
  }
  return true;
}

Eigen::Vector3d ViewRays::in_camera(double x, double y, double distance) const {
  return distance * through(x, y).normalized();
}

void ViewRays::place(const Rigid3d& cam_from_world, const Space& space) {
  world_from_cam_ = cam_from_world.rotation.conjugate().toRotationMatrix();
  origin_ = space.normalized(camera_center(cam_from_world));
}

Rigid3d ViewRays::moved(const Eigen::Vector3d& shift, const Eigen::Vector3d& turn,
                        const Space& space) const {
  const Eigen::Matrix3d world_from_cam =
      world_from_cam_ * turned_by(turn).conjugate().toRotationMatrix();
  const Eigen::Vector3d origin = origin_ - world_from_cam * shift;
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose())).normalized();
  return {rotation, -(rotation * (space.center + space.radius * origin))};
}

RayNumbers ViewRays::numbers() const {
  RayNumbers out{
      camera_.width, camera_.height, camera_.fx, camera_.fy, camera_.cx, camera_.cy, {}, {}, 0, 0};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) out.world_from_cam[i][k] = world_from_cam_(i, k);
    out.origin[i] = origin_[i];
  }
  if (lattice_.empty()) return out;
  out.lattice_columns = lattice_width_;
  out.lattice_rows = static_cast<int>(lattice_.size()) / lattice_width_;
  return out;
}

const float* ViewRays::lattice() const {
  return lattice_.empty() ? nullptr : lattice_.front().data();
}

bool ViewRays::project(const float point[3], double& x, double& y, double& depth) const {
  const Eigen::Vector3d p =
      world_from_cam_.transpose() * (Eigen::Vector3d(point[0], point[1], point[2]) - origin_);
  depth = p.z();
  if (depth <= 1e-6) return false;
  const Eigen::Vector2d pixel = camera_.project(p);
  x = pixel.x();
  y = pixel.y();
  return x >= 0 && y >= 0 && x < camera_.width && y < camera_.height;
}

}  // namespace orbitfuse::nerf
