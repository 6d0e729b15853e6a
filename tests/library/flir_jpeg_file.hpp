// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "core/radiometry/flir_temperature.hpp"

namespace orbitfuse::test {

/// A radiometric JPEG of these raw counts (CV_16UC1, at most 30,000 pixels), as a FLIR camera with
/// this calibration and the object right before it would write it.
std::string flir_jpeg_file(const cv::Mat& counts, const PlanckConstants& planck);

}  // namespace orbitfuse::test
