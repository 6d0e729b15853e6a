// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace orbitfuse::synthetic {

struct Ray {
  Eigen::Vector3d origin, direction;  ///< direction of unit length
};

struct Hit {
  double distance = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  std::optional<int> solid = {};  ///< index in the scene; absent: nothing is hit
};

enum class Material {
  ground,
  paint,
  cabin,
  tyre,
  rim,
  trim,
  lamp,
  exhaust,
  crate,
  brick,
  barrel,
  building
};

/// A convex body: an intersection of half-spaces n.x <= d, and for a cylinder also the tube.
class Solid {
 public:
  Material material = Material::brick;
  std::uint64_t seed = 0;  ///< of its texture

  static Solid box(const Eigen::Vector3d& center, const Eigen::Vector3d& half_size,
                   double yaw_deg = 0);
  /// A convex polygon in (x, z), counter-clockwise, between y = -half_width and half_width; the
  /// sides lean inwards by `lean` (y per z) above z = lean_from.
  static Solid prism(const std::vector<Eigen::Vector2d>& polygon, double half_width,
                     double lean = 0, double lean_from = 0);
  static Solid cylinder(const Eigen::Vector3d& center, const Eigen::Vector3d& axis, double radius,
                        double half_length);

  Solid with(Material m, std::uint64_t texture_seed) const {
    Solid out = *this;
    out.material = m;
    out.seed = texture_seed;
    return out;
  }

  /// Replaces `hit` when this solid is nearer. Rays that start inside see nothing of it.
  bool intersect(const Ray& ray, double min_distance, Hit& hit) const;
  const Eigen::Vector3d& center() const { return center_; }

 private:
  struct HalfSpace {
    Eigen::Vector3d normal;
    double offset;
  };
  bool clip_tube(const Ray& ray, double& enter, double& leave, Eigen::Vector3d& normal) const;

  std::vector<HalfSpace> half_spaces_;
  std::optional<double> tube_radius_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero(), axis_ = Eigen::Vector3d::UnitZ();
  double bounding_radius_ = 0;
};

}  // namespace orbitfuse::synthetic
