// SPDX-License-Identifier: BSD-3-Clause
#include "core/geometry/camera.hpp"

#include <fmt/format.h>

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace orbitfuse {
namespace {

/// OpenCV radial-tangential model: distorted point and, if wanted, its Jacobian.
Eigen::Vector2d distort(const Camera& c, const Eigen::Vector2d& p, Eigen::Matrix2d* jacobian) {
  const double x = p.x(), y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (c.k1 + r2 * c.k2);
  if (jacobian) {
    const double dr = c.k1 + 2.0 * c.k2 * r2;  // d radial / d r2
    const double cross = 2.0 * (x * y * dr + c.p1 * x + c.p2 * y);
    *jacobian << radial + 2.0 * x * x * dr + 2.0 * c.p1 * y + 6.0 * c.p2 * x, cross, cross,
        radial + 2.0 * y * y * dr + 6.0 * c.p1 * y + 2.0 * c.p2 * x;
  }
  return {x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x),
          y * radial + c.p1 * (r2 + 2.0 * y * y) + 2.0 * c.p2 * x * y};
}

}  // namespace

Status Camera::validate(const std::string& where) const {
  if (width <= 0 || height <= 0) {
    return fail(ErrorKind::input, where, fmt::format("image size {}x{}", width, height),
                "give a positive width and height");
  }
  const std::array<std::pair<const char*, double>, 8> fields{{{"fx", fx},
                                                              {"fy", fy},
                                                              {"cx", cx},
                                                              {"cy", cy},
                                                              {"k1", k1},
                                                              {"k2", k2},
                                                              {"p1", p1},
                                                              {"p2", p2}}};
  for (const auto& [field, value] : fields) {
    if (!std::isfinite(value)) {
      return fail(ErrorKind::input, where + "." + field, "not a finite number",
                  "correct the camera");
    }
  }
  for (const double distortion : {k1, k2, p1, p2}) {
    // No lens bends like that; a row of such numbers overflows.
    if (std::abs(distortion) > 1e3) {
      return fail(ErrorKind::input, where,
                  fmt::format("a distortion coefficient of {:g}", distortion),
                  "correct the camera");
    }
  }
  if (fx <= 0 || fy <= 0) {
    return fail(ErrorKind::input, where, fmt::format("focal length {} x {} pixels", fx, fy),
                "must be > 0");
  }
  // Fields of view from half a degree to 170.
  const double side = std::max(width, height);
  for (const double focal : {fx, fy}) {
    if (focal < 0.04 * side || focal > 120 * side) {
      return fail(
          ErrorKind::input, where,
          fmt::format("focal length {:g} pixels for an image of {}x{}", focal, width, height),
          "give it in pixels of this image size");
    }
  }
  // A crop may lie beside the optical axis, not beyond what a lens shows.
  if (std::abs(cx - 0.5 * width) > 3 * fx || std::abs(cy - 0.5 * height) > 3 * fy) {
    return fail(ErrorKind::input, where,
                fmt::format("principal point ({:g}, {:g}) far outside an image of {}x{}", cx, cy,
                            width, height),
                "give cx and cy in pixels of this image size");
  }
  return {};
}

Eigen::Vector2d Camera::pixel_of(const Eigen::Vector2d& normalized) const {
  const Eigen::Vector2d p = has_distortion() ? distort(*this, normalized, nullptr) : normalized;
  return {fx * p.x() + cx, fy * p.y() + cy};
}

Eigen::Vector2d Camera::normalized_of(const Eigen::Vector2d& pixel) const {
  Eigen::Vector2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!has_distortion()) return target;
  Eigen::Vector2d p = target;
  for (int i = 0; i < 20; ++i) {  // Newton
    Eigen::Matrix2d jacobian;
    const Eigen::Vector2d error = distort(*this, p, &jacobian) - target;
    // The model folds over where its Jacobian loses sign: no pixel there has a valid ray.
    if (!(jacobian.determinant() > 1e-6)) break;
    const Eigen::Vector2d step = jacobian.inverse() * error;
    p -= step;
    if (step.squaredNorm() < 1e-24) return p;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  return {nan, nan};
}

Eigen::Vector2d Camera::project(const Eigen::Vector3d& x_in_cam) const {
  if (!(x_in_cam.z() > 0)) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan};
  }
  return pixel_of(x_in_cam.head<2>() / x_in_cam.z());
}

Eigen::Vector3d Camera::ray_of(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d p = normalized_of(pixel);
  return {p.x(), p.y(), 1.0};
}

Camera Camera::scaled_to(int new_width, int new_height) const {
  const double sx = static_cast<double>(new_width) / width;
  const double sy = static_cast<double>(new_height) / height;
  Camera c = *this;
  c.width = new_width;
  c.height = new_height;
  c.fx *= sx;
  c.cx *= sx;
  c.fy *= sy;
  c.cy *= sy;
  return c;
}

Camera Camera::without_distortion() const {
  Camera c = *this;
  c.k1 = c.k2 = c.p1 = c.p2 = 0;
  return c;
}

double Camera::horizontal_fov_deg() const {
  return 2.0 * std::atan(0.5 * width / fx) * 180.0 / std::numbers::pi;
}

Camera Camera::from_fov(int width, int height, double horizontal_fov_deg) {
  Camera c;
  c.width = width;
  c.height = height;
  c.fx = c.fy = 0.5 * width / std::tan(0.5 * horizontal_fov_deg * std::numbers::pi / 180.0);
  c.cx = 0.5 * width;
  c.cy = 0.5 * height;
  return c;
}

}  // namespace orbitfuse
