// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "core/image/image_codec.hpp"
#include "core/modality.hpp"

namespace orbitfuse {

/// The newest frame of a modality, as it was decoded once, upright: CV_8UC3 BGR, CV_8UC1, or
/// CV_16UC1 counts of temperature (0: invalid).
struct LatestFrame {
  Modality modality = Modality::visible;
  cv::Mat pixels;
  std::string name;  ///< tells one frame from another: its file, or a number before recording
  ThermalScaleTag scale = {};  ///< of 16-bit pixels
};

}  // namespace orbitfuse
