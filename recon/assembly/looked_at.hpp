// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/image/palette.hpp"

// What of a scene its pictures are about: the colours of a palette belong to the object that the
// cameras went round, not to a cold sky behind it.
namespace orbitfuse {

/// One view's thermal image with where each of its pixels lies.
struct ThermalView {
  PosedView view;   ///< camera without distortion
  cv::Mat thermal;  ///< CV_32FC1, NaN = nothing measured
  cv::Mat depth;    ///< CV_32FC1 along the optical axis, in the unit of the poses; NaN = unknown
};

/// The thermal images with NaN wherever the point seen is farther than `reach` times the orbit's
/// radius from the point that the recorded cameras `orbit` look at. As they are where that says
/// nothing: the cameras' axes meet nowhere, or less than a twentieth of what was measured lies
/// within.
std::vector<cv::Mat> within_orbit(const std::vector<ThermalView>& views,
                                  const std::vector<PosedView>& orbit, double reach);

/// Reaches for the two questions that are asked: what the object is, and what surrounds it.
inline constexpr double object_reach = 0.6, surroundings_reach = 2;

/// One span for all views: that of the object (0.5 % of its samples are colder, 0.01 % hotter, so
/// that a small hot part still has a colour of its own), at least 0.5 K wide.
TemperatureSpan object_span(const std::vector<ThermalView>& views,
                            const std::vector<PosedView>& orbit);

}  // namespace orbitfuse
