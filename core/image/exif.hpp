// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace orbitfuse {

/// What a photo says of itself; absent or malformed fields stay empty.
struct ExifInfo {
  int orientation = 1;  ///< 1..8, TIFF 6.0; 1 = as stored
  std::optional<double> focal_mm;
  std::optional<double> focal_35mm;      ///< equivalent for a 36 x 24 mm frame, by diagonal
  std::optional<std::int64_t> taken_ns;  ///< DateTimeOriginal with SubSec; UTC if an offset is
                                         ///< given, else the camera's clock read as UTC
  bool taken_has_offset = false;
  std::int64_t utc_offset_s = 0;  ///< that offset: local time less UTC
  std::string make, model, serial;
};

/// Never fails: bytes without EXIF give the defaults.
ExifInfo read_exif(std::string_view bytes);

}  // namespace orbitfuse
