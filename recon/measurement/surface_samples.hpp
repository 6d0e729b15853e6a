// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/measurement/request.hpp"
#include "recon/measurement/thermal_scene.hpp"

// Points of the surface that stand for a region.
namespace orbitfuse::measurement {

constexpr int normal_reach = 2;  ///< pixels beside a point of a depth map that its normal is of

/// Within a box: what thermal frames see of the surface, one point a cell of a grid over the box of
/// at most 32 cells along its longest side. Empty: no frame sees a surface in it.
Result<std::vector<SurfacePoint>> box_samples(const ThermalScene& scene, const OrientedBox& box,
                                              const Progress& progress);

/// Of the object that the cameras went round (recon/assembly/looked_at.hpp), one point a cell of
/// 1/150 of its reach. Input error where the cameras' axes meet nowhere.
Result<std::vector<SurfacePoint>> object_samples(const ThermalScene& scene,
                                                 const Progress& progress);
/// Its reach: no point of it is farther from scene.middle().
double object_radius(const ThermalScene::Middle& middle);

/// Whether two sides cross, so that parts of what was gone round count as outside.
bool crosses_itself(const std::vector<Eigen::Vector2d>& corners);

/// Within a polygon in a view, at most 64 rays along its longer side, weighted by area. Pixels
/// where the field has no surface are left out. Input error: the polygon lies outside the picture.
Result<std::vector<SurfacePoint>> polygon_samples(const ThermalScene& scene, const PosedView& view,
                                                  const std::vector<Eigen::Vector2d>& corners,
                                                  const Progress& progress);

}  // namespace orbitfuse::measurement
