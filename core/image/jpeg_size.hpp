// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string_view>

namespace orbitfuse {

/// Of a JPEG, from its headers alone and without EXIF orientation; nothing where they are damaged.
std::optional<cv::Size> jpeg_size(std::string_view bytes);

}  // namespace orbitfuse
