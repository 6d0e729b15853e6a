// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/jpeg_segments.hpp"

namespace orbitfuse {

std::vector<JpegSegment> jpeg_segments(std::string_view jpeg) {
  constexpr std::size_t start_of_image = 2;
  constexpr unsigned char start_of_scan = 0xda, end_of_image = 0xd9;
  std::vector<JpegSegment> segments;
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(jpeg[i]); };
  for (std::size_t at = start_of_image; at + 4 <= jpeg.size() && byte(at) == 0xff;) {
    const unsigned char marker = byte(at + 1);
    if (marker == 0xff) {
      ++at;  // fill byte
      continue;
    }
    if (marker == start_of_scan || marker == end_of_image) break;
    const std::size_t length = static_cast<std::size_t>(byte(at + 2)) << 8 | byte(at + 3);
    if (length < 2 || at + 2 + length > jpeg.size()) break;
    segments.push_back({marker, jpeg.substr(at + 4, length - 2)});
    at += 2 + length;
  }
  return segments;
}

}  // namespace orbitfuse
