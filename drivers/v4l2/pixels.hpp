// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "capture/frame_source.hpp"
#include "core/result.hpp"

namespace orbitfuse::v4l2 {

/// The format the driver agreed to (VIDIOC_S_FMT's answer).
struct Layout {
  std::uint32_t fourcc = 0;  ///< V4L2_PIX_FMT_*
  int width = 0, height = 0;
  int bytes_per_line = 0;
};

std::string fourcc_text(std::uint32_t fourcc);
bool is_supported(std::uint32_t fourcc);

/// Puts one buffer's bytes into frame.pixels or, for MJPEG, byte for byte into frame.encoded.
/// The error says why the buffer is damaged: too short for its format, or a JPEG without its
/// start or end marker. YUYV and NV12 become BGR (BT.601); Y16 stays as it is.
Status unpack(std::span<const std::uint8_t> bytes, const Layout& layout, Frame& frame);

}  // namespace orbitfuse::v4l2
