// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/level_plane.hpp"

namespace orbitfuse::depth {

/// How near the surroundings of a camera are, by azimuth and elevation over a plane, also where its
/// image does not reach.
class Panorama {
 public:
  /// `points`: what is confirmed and is not the plane, in the plane's frame and unit.
  Panorama(const Eigen::Vector3f& eye, const LevelPlane& plane,
           const std::vector<std::vector<Eigen::Vector3f>>& points);

  /// Whether something in this place's azimuth is seen above it and stands nearer than `share` of
  /// its distance, both along the plane: a body whose upper edge is known hides the plane as far
  /// down as it reaches.
  bool hides(const Eigen::Vector3f& place, float share) const;

 private:
  struct Direction {
    int azimuth, elevation;
    float distance;
  };
  Direction direction_of(const Eigen::Vector3f& place) const;

  Eigen::Vector3f eye_, up_, ahead_, left_;
  std::vector<float> nearest_;  ///< azimuth by azimuth: along the plane, at this elevation or above
};

}  // namespace orbitfuse::depth
