// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/image/exif.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// What a drone's operator set for temperatures.
struct DjiParameters {
  double emissivity = 1, distance_m = 0, humidity = 0;  ///< humidity: 0..1
  double reflected_c = 0, ambient_c = 0;
};

/// What a thermal JPEG of a DJI drone holds. How its counts become temperatures is DJI's own and
/// not published; they stay counts.
struct DjiImage {
  cv::Mat counts;  ///< CV_16UC1, as the sensor's processing left them
  std::optional<DjiParameters> parameters;
  ExifInfo exif;
};

/// True for a JPEG made by DJI that carries a thermal plane in its APP3 segments.
bool is_dji_thermal(std::string_view bytes);

/// Reads that plane (its size follows from its length, layout as users of ExifTool's forum worked
/// it out) and, where their place is known, the parameters in APP4 (tables of the ExifTool project:
/// H20T; M3T, H20N, M2EA, M30T). Input error when the plane has no size that such cameras have.
Result<DjiImage> read_dji_thermal(std::string_view bytes, const std::string& where);

}  // namespace orbitfuse
