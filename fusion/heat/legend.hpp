// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "fusion/heat/heat.hpp"

namespace orbitfuse::fusion {

/// The unit of a scale's levels.
enum class HeatUnit {
  kelvin,  ///< shown in degrees Celsius
  gray,    ///< gray levels
};

struct HeatLegend {
  HeatScale scale;
  HeatUnit unit = HeatUnit::kelvin;
  HeatOptions how;  ///< as the pictures were coloured
};

/// The colours alone, CV_8UC3 `width` x 1, from the usual level to the hot one. Usage errors:
/// options.
Result<cv::Mat> heat_ramp(const HeatLegend& legend, int width);

/// A strip of `width` pixels (CV_8UC3) to put under a picture: the colours over mid gray from the
/// usual level to the hot one with ticks, the hatching of "not measured", and a sentence that says
/// so. Usage errors: options.
Result<cv::Mat> heat_legend(const HeatLegend& legend, int width);

/// The picture (CV_8UC3) with the legend of its width below.
Result<cv::Mat> with_heat_legend(const cv::Mat& picture, const HeatLegend& legend);

}  // namespace orbitfuse::fusion
