// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "capture/frame_source.hpp"
#include "core/image/image_codec.hpp"
#include "core/modality.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// A frame as it goes to disk.
struct EncodedFrame {
  std::string bytes, extension;
  cv::Mat pixels;  ///< upright, for measurements
  bool has_temperature = false;
  ThermalScaleTag scale;  ///< of the pixels, when they are temperatures
};

struct UprightFrame {
  cv::Mat pixels;
  ThermalScaleTag scale;  ///< of 16-bit thermal pixels
};

/// The frame's image, upright; input error when it isn't one of its modality.
Result<UprightFrame> upright_frame(const Frame& frame, Modality modality, const std::string& where);

/// Encodes `pixels` without loss, or checks that `encoded` decodes as the modality demands.
/// Input error (the frame is bad) otherwise.
Result<EncodedFrame> encode_frame(const Frame& frame, Modality modality, const std::string& where);

}  // namespace orbitfuse
