// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/measurement/answer.hpp"
#include "recon/measurement/frame_readings.hpp"

namespace orbitfuse::measurement {

/// The temperature at one point of the surface.
Result<TemperatureReading> read_spot(const ThermalScene& scene, const SurfacePoint& surface,
                                     const Reradiometry& radiometry, const Progress& progress);

/// Of several points together, weighted by SurfacePoint::weight: those that no frame sees count in
/// `points` and field_k only.
Result<TemperatureReading> read_region(const ThermalScene& scene,
                                       const std::vector<SurfacePoint>& points,
                                       const Reradiometry& radiometry, const Progress& progress);

/// Up to `count` of the points, at least `apart` from each other, of those that two frames see
/// (one, where the scene has no more). Chosen by what is sure: temperature less twice its
/// uncertainty for the hottest, and with it for the coldest; else edges, where frames mix two
/// surfaces, would come first. In the order of their temperatures.
Result<std::vector<PlacedReading>> extremes(const ThermalScene& scene,
                                            const std::vector<SurfacePoint>& points, bool hottest,
                                            int count, double apart, const Reradiometry& radiometry,
                                            const Progress& progress);

}  // namespace orbitfuse::measurement
