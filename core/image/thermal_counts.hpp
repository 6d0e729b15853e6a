// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "core/image/image_codec.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// A thermal file as it is stored.
struct ThermalCounts {
  cv::Mat image;  ///< CV_16UC1, 0: invalid
  ThermalScaleTag scale;
};

/// From a 16-bit TIFF or PNG; read_thermal_k() is the same as kelvin. The scale comes from the
/// file's own tag, else from its sidecar <file>.json, else centikelvin is assumed. Input errors
/// name the file.
Result<ThermalCounts> read_thermal_counts(const std::filesystem::path& path);

/// CV_32FC1; invalid_k where a count is 0 or means no temperature (0 K or less). Reduce the result,
/// not the counts: their mean with a dead pixel is a temperature that nobody saw.
cv::Mat kelvin_of_counts(const ThermalCounts& counts);

}  // namespace orbitfuse
