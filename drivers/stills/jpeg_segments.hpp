// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>
#include <vector>

namespace orbitfuse {

struct JpegSegment {
  unsigned char marker = 0;  ///< its second byte: 0xe1 is APP1
  std::string_view payload;  ///< of the bytes given
};

/// A JPEG's segments before its picture's data, in order, as far as they are whole.
std::vector<JpegSegment> jpeg_segments(std::string_view jpeg);

}  // namespace orbitfuse
