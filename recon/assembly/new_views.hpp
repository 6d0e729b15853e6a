// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/result.hpp"

namespace orbitfuse {

enum class PathKind {
  automatic,  ///< an orbit when the cameras surround the scene, else their path
  orbit,
  path,
};

struct NewViewOptions {
  PathKind path = PathKind::automatic;
  int views = 8;            ///< new cameras along the path
  int width_px = 640;       ///< of a rendered image; its height follows the visible camera, upright
  double azimuth_deg = 15;  ///< first view, from the first camera: between 30 degree stations
  std::optional<double> elevation_deg;  ///< of an orbit; none: the cameras' median
  double radius_scale = 1;              ///< of an orbit, times the cameras' median distance

  Status validate() const;
};

/// Where a set of cameras stands round what it looks at.
struct OrbitGeometry {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< nearest to all optical axes
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d first = Eigen::Vector3d::UnitX();  ///< azimuth 0: towards the first camera
  double radius = 1, elevation_deg = 0;              ///< medians
  double azimuth_span_deg = 0;  ///< 360 less the largest gap between neighbouring cameras
};

/// Input error for fewer than two cameras or cameras that all look in one direction (no centre).
Result<OrbitGeometry> orbit_geometry(const std::vector<PosedView>& views);

struct NewViews {
  std::vector<PosedView> views;
  std::string described;  ///< "orbit of 8 views at 24 deg elevation"
};

/// Cameras for rendering, in the frame of `posed`, without distortion. Errors: usage (options),
/// orbit_geometry's.
Result<NewViews> new_views(const std::vector<PosedView>& posed, const NewViewOptions& options);

}  // namespace orbitfuse
