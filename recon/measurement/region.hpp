// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/measurement/answer.hpp"
#include "recon/measurement/frame_readings.hpp"

namespace orbitfuse::measurement {

// Errors of all: those of read_frames.

/// The temperature at one point of the surface.
Result<TemperatureReading> read_spot(const ThermalScene& scene, const SurfacePoint& surface,
                                     const Reradiometry& radiometry, const Progress& progress);

/// Of several points together, weighted by SurfacePoint::weight: those that no frame sees count in
/// `points`, `hidden` and field_k only, and FrameLine::covered is of all.
Result<TemperatureReading> read_region(const ThermalScene& scene,
                                       const std::vector<SurfacePoint>& points,
                                       const Reradiometry& radiometry, const Progress& progress);

/// A point's temperature in short, for many points at once.
struct PointTemperature {
  double temperature_k = unknown, uncertainty_k = unknown;  ///< as in TemperatureReading
  int frames = 0;                                           ///< that see it
  bool two_camps = false;  ///< they contradict each other (Agreement)
  bool seen() const { return frames > 0; }
};

/// Of each point, in their order, as read_spot has it.
Result<std::vector<PointTemperature>> read_points(const ThermalScene& scene,
                                                  const std::vector<SurfacePoint>& points,
                                                  const Reradiometry& radiometry,
                                                  const Progress& progress);

/// Up to `count` of the points, at least `apart` from each other, of those that two frames see
/// (one, where the scene has no more), in the order of their temperatures. Not where frames are in
/// two camps (Agreement): that is an edge, where their mean is nobody's temperature. The hottest
/// are chosen by temperature alone, because what is small and hot is unsure, and looked for; the
/// coldest by temperature and twice its uncertainty, because a rim that mixes with the sky would
/// come first.
Result<std::vector<PlacedReading>> extremes(const ThermalScene& scene,
                                            const std::vector<SurfacePoint>& points, bool hottest,
                                            int count, double apart, const Reradiometry& radiometry,
                                            const Progress& progress);

}  // namespace orbitfuse::measurement
