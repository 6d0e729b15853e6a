// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace orbitfuse {

/// A JPEG-LS stream (ISO 14495-1), in which newer cameras keep raw thermal samples.
bool is_jpeg_ls(std::string_view bytes);

/// CV_16UC1 samples of a stream of one component with 9 to 16 bits; anything else is an input
/// error.
Result<cv::Mat> decode_jpeg_ls(std::string_view bytes, const std::string& where);

}  // namespace orbitfuse
