// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/solid.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace orbitfuse::synthetic {

using Eigen::Vector3d;

Solid Solid::box(const Vector3d& center, const Vector3d& half_size, double yaw_deg) {
  Solid s;
  s.center_ = center;
  s.bounding_radius_ = half_size.norm();
  const Eigen::Matrix3d r =
      Eigen::AngleAxisd(yaw_deg * std::numbers::pi / 180, Vector3d::UnitZ()).toRotationMatrix();
  for (int k = 0; k < 3; ++k) {
    const Vector3d n = r.col(k);
    s.half_spaces_.push_back({n, n.dot(center) + half_size[k]});
    s.half_spaces_.push_back({-n, -n.dot(center) + half_size[k]});
  }
  return s;
}

Solid Solid::prism(const std::vector<Eigen::Vector2d>& polygon, double half_width, double lean,
                   double lean_from) {
  Solid s;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& p : polygon) middle += p / static_cast<double>(polygon.size());
  s.center_ = {middle.x(), 0, middle.y()};
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const Vector3d n = Vector3d(b.y() - a.y(), 0, a.x() - b.x()).normalized();
    s.half_spaces_.push_back({n, n.dot(Vector3d(a.x(), 0, a.y()))});
    s.bounding_radius_ = std::max(s.bounding_radius_, std::hypot((a - middle).norm(), half_width));
  }
  for (const double side : {1.0, -1.0}) {
    const Vector3d n = Vector3d(0, side, lean).normalized();
    s.half_spaces_.push_back({n, n.dot(Vector3d(0, side * half_width, lean_from))});
  }
  return s;
}

Solid Solid::cylinder(const Vector3d& center, const Vector3d& axis, double radius,
                      double half_length) {
  Solid s;
  s.center_ = center;
  s.axis_ = axis.normalized();
  s.tube_radius_ = radius;
  s.bounding_radius_ = std::hypot(radius, half_length);
  s.half_spaces_.push_back({s.axis_, s.axis_.dot(center) + half_length});
  s.half_spaces_.push_back({-s.axis_, -s.axis_.dot(center) + half_length});
  return s;
}

bool Solid::clip_tube(const Ray& ray, double& enter, double& leave, Vector3d& normal) const {
  const Vector3d o = ray.origin - center_;
  const Vector3d d_side = ray.direction - ray.direction.dot(axis_) * axis_;
  const Vector3d o_side = o - o.dot(axis_) * axis_;
  const double a = d_side.squaredNorm(), b = o_side.dot(d_side);
  const double c = o_side.squaredNorm() - *tube_radius_ * *tube_radius_;
  if (a < 1e-18) return c <= 0;  // along the axis: the caps decide
  const double discriminant = b * b - a * c;
  if (discriminant <= 0) return false;
  const double root = std::sqrt(discriminant);
  if (const double t = (-b - root) / a; t > enter) {
    enter = t;
    normal = (o_side + t * d_side).normalized();
  }
  leave = std::min(leave, (-b + root) / a);
  return enter < leave;
}

bool Solid::intersect(const Ray& ray, double min_distance, Hit& hit) const {
  const Vector3d to_center = center_ - ray.origin;
  const double along = to_center.dot(ray.direction);
  const double r2 = bounding_radius_ * bounding_radius_;
  if (to_center.squaredNorm() - along * along > r2) return false;
  if (along + bounding_radius_ < min_distance || along - bounding_radius_ > hit.distance)
    return false;

  double enter = -std::numeric_limits<double>::infinity(), leave = hit.distance;
  Vector3d normal = Vector3d::UnitZ();
  for (const HalfSpace& h : half_spaces_) {
    const double speed = h.normal.dot(ray.direction);
    const double gap = h.offset - h.normal.dot(ray.origin);
    if (std::abs(speed) < 1e-12) {
      if (gap < 0) return false;
    } else if (speed < 0) {
      if (const double t = gap / speed; t > enter) {
        enter = t;
        normal = h.normal;
      }
    } else {
      leave = std::min(leave, gap / speed);
    }
    if (enter >= leave) return false;
  }
  if (tube_radius_ && !clip_tube(ray, enter, leave, normal)) return false;
  if (!(enter > min_distance) || enter >= hit.distance) return false;
  hit.distance = enter;
  hit.normal = normal;
  return true;
}

}  // namespace orbitfuse::synthetic
