// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/transform.hpp"

namespace orbitfuse {

/// What a set of cameras looks at, as a unit of length for stages that need one.
struct SceneBall {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1;  ///< mean distance of the cameras; 1 when that is 0 or not finite
};

/// Centre: the point nearest to all optical axes; where they don't meet (one view, a straight path)
/// the median of the points, and without points as far ahead as twice the cameras' spread.
SceneBall scene_ball(const std::vector<Rigid3d>& cam_from_world,
                     std::vector<Eigen::Vector3d> points);

/// RMS distance of places from their middle; 0 of none.
double rms_radius(const std::vector<Eigen::Vector3d>& places);

}  // namespace orbitfuse
