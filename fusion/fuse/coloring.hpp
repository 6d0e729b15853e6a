// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse {

/// Hue tells the temperature, brightness stays the fused image's.
struct TemperatureOverlay {
  std::string palette;  ///< one of palette_names() (core/image/palette.hpp); empty = no overlay
  double strength = 1;  ///< 0..1: the palette's colour against the visible one

  Status validate() const;  ///< usage error naming the field
};

/// The fused luma with the visible image's colour differences (1 or 3 channels of floats, 0..255),
/// and with the overlay's where `measured` is 1 (0..1; empty = everywhere). Returns three channels
/// of floats. Usage errors: the overlay's.
Result<cv::Mat> colored(const fusion::Plane& fused, const cv::Mat& visible,
                        const fusion::Plane& thermal, const fusion::Plane& measured,
                        const TemperatureOverlay& overlay);

}  // namespace orbitfuse
