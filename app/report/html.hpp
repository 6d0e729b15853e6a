// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

namespace orbitfuse::report {

/// Text safe inside elements and double-quoted attributes.
std::string escape(std::string_view text);
/// JSON safe inside a script element.
std::string escape_json(std::string text);
std::string base64(std::string_view bytes);
/// "data:image/jpeg;base64,...", at most `max_width` wide.
std::string data_uri(const cv::Mat& image, int max_width, int quality = 88);

}  // namespace orbitfuse::report
