// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "core/image/exif.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// Whether the bytes begin as the HEIC (HEIF) photos of phones do.
bool is_heif(std::string_view bytes);

/// The photo in a HEIC file, upright, CV_8UC3 BGR: its own rotation, mirroring and cropping are
/// applied, alpha is dropped. `transparent` gets the share of its pixels that are not wholly
/// opaque. Input error when it is damaged, too large, or one of several photos in the file.
Result<cv::Mat> decode_heif(std::string_view bytes, const std::string& where,
                            double* transparent = nullptr);

/// Never fails, as read_exif(). The orientation is 1: in HEIC the file's own rotation counts, and
/// EXIF says the same a second time.
ExifInfo heif_exif(std::string_view bytes);

}  // namespace orbitfuse
