// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace orbitfuse::v4l2::guest {

using Bytes = std::vector<std::uint8_t>;

constexpr int width = 320, height = 240;
/// Payload header and data in one transfer: as large as uvcvideo makes its bulk requests
/// (32 packets of 512 bytes), so that each request carries one payload.
constexpr std::uint32_t payload_bytes = 32 * 512;

/// bFormatIndex of the three formats that the camera has.
enum class Format : std::uint8_t { yuyv = 1, mjpeg = 2, y16 = 3 };
/// Of YUYV and Y16; the upper bound of MJPEG.
constexpr std::uint32_t frame_bytes = width * height * 2;

/// Entities of the video function (UVC 1.1, section 3.7): camera -> processing unit -> stream.
constexpr std::uint8_t camera_terminal = 1, processing_unit = 2, output_terminal = 3;
constexpr std::uint8_t streaming_interface = 1;
constexpr std::uint8_t bulk_endpoint = 1;  ///< IN

/// USB 2.0 section 9.6 and UVC 1.1 sections 3.1 to 3.10: one configuration with a bulk endpoint.
Bytes device_descriptor();
Bytes configuration_descriptor(std::uint32_t interval_100ns);
/// 0: the languages; else UTF-16 of an ASCII text.
Bytes string_descriptor(const std::string& text);
Bytes language_descriptor();

/// Little-endian, as everything on USB.
void put(Bytes& bytes, std::uint64_t value, int count);
std::uint32_t get(const Bytes& bytes, std::size_t offset, int count);

}  // namespace orbitfuse::v4l2::guest
