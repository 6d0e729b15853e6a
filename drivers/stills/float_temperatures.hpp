// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "core/image/image_codec.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// Temperatures that a file holds as 32-bit floats, as counts that a session can store.
struct FloatTemperatures {
  cv::Mat counts;  ///< CV_16UC1, 0: no temperature, 65535: one that no scale holds
  ThermalScaleTag scale;
  const char* unit = "";  ///< "kelvin" or "Celsius": which the numbers were taken for
};

/// Of CV_32FC1. What is not finite or below 0 K (a program's -9999) is no temperature. The unit is
/// told by the median: from 173 on kelvin (-100 C), below it Celsius; a scene of 173 C and more in
/// Celsius would be taken for a cold one, so the unit is to be shown to the user. Input error where
/// neither fits.
Result<FloatTemperatures> float_temperatures(const cv::Mat& values, const std::string& where);

}  // namespace orbitfuse
