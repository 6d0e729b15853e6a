// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "recon/registration/clouds/prepared_cloud.hpp"

namespace orbitfuse::registration {

/// A point of one cloud against the tangent plane of its partner in the other.
struct Pair {
  Eigen::Vector3d at;      ///< the point, in the target's frame, unbent
  Eigen::Vector3d lever;   ///< the same from the source's centre
  Eigen::Vector3d normal;  ///< of the surface it is measured against
  double residual;         ///< plane distance, target unit lengths
  double trust;            ///< 0..1
};

struct NoDisplacement {
  Eigen::Vector3d operator()(const Eigen::Vector3d&) const { return Eigen::Vector3d::Zero(); }
};
inline constexpr NoDisplacement no_displacement;

/// Partners in both directions at one placement. A displacement bends the moved source: a smooth
/// field over the target's frame, target unit lengths.
template <typename Displacement>
class Pairs {
 public:
  Pairs(const PreparedCloud& source, const PreparedCloud& target, const Similarity3d& placement,
        double bound, bool exact, const Displacement& displacement)
      : exact_(exact),
        source_(source),
        target_(target),
        placement_(placement),
        inverse_(placement.inverse()),
        rotation_(placement.rotation.toRotationMatrix()),
        bound2_(bound * bound),
        displacement_(displacement) {}

  bool forward(std::size_t i, Pair& pair) const {
    pair.at = moved(i);
    const Eigen::Vector3d bent = pair.at + displacement_(pair.at);
    const std::optional<std::size_t> j = partner(target_, bent);
    if (!j) return false;
    const Eigen::Vector3d d = bent - target_.points[*j];
    if (d.squaredNorm() > bound2_) return false;
    pair.normal = target_.normals[*j];
    return finish(pair, d, rotation_ * source_.normals[i], target_.trust[*j] * source_.trust[i]);
  }

  /// The target's point z against the source's plane. The scale's derivative is taken at z, as if
  /// the target moved the other way, so that noise biases the two directions oppositely and
  /// cancels.
  bool backward(std::size_t j, Pair& pair) const {
    pair.at = target_.points[j] - displacement_(target_.points[j]);
    const std::optional<std::size_t> i =
        partner(source_, inverse_.scale * (rotation_.transpose() * pair.at) + inverse_.translation);
    if (!i) return false;
    const Eigen::Vector3d d = moved(*i) - pair.at;
    if (d.squaredNorm() > bound2_) return false;
    pair.normal = rotation_ * source_.normals[*i];
    return finish(pair, d, target_.normals[j], target_.trust[j] * source_.trust[*i]);
  }

 private:
  Eigen::Vector3d moved(std::size_t i) const {
    return placement_.scale * (rotation_ * source_.points[i]) + placement_.translation;
  }
  std::optional<std::size_t> partner(const PreparedCloud& cloud, const Eigen::Vector3d& x) const {
    return exact_ ? cloud.nearest(x) : cloud.nearest_table.lookup(x);
  }
  bool finish(Pair& pair, const Eigen::Vector3d& d, const Eigen::Vector3d& other,
              double trust) const {
    const double cosine = pair.normal.dot(other);
    if (cosine * cosine < 0.25) return false;
    pair.lever = pair.at - placement_.translation;
    pair.residual = pair.normal.dot(d);
    pair.trust = cosine * cosine * trust;
    return true;
  }
  const bool exact_;
  const PreparedCloud& source_;
  const PreparedCloud& target_;
  const Similarity3d& placement_;
  const Similarity3d inverse_;
  const Eigen::Matrix3d rotation_;
  const double bound2_;
  const Displacement& displacement_;
};

/// Tukey's biweight: 0 beyond the bound.
inline double tukey(double residual, double bound) {
  const double u = residual / bound, v = 1 - u * u;
  return v > 0 ? v * v : 0;
}

/// In standard deviations of the residuals: Tukey's bound of 95 % efficiency.
inline constexpr double tukey_sigmas = 4.685;
/// Seven parameters and a few more: what is below is no set of equations.
inline constexpr std::size_t fewest_pairs = 10;

/// Standard deviation from the median of the sizes, which it reorders.
double robust_sigma(std::vector<double>& sizes);

}  // namespace orbitfuse::registration
