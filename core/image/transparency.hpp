// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string_view>

// Decoders drop alpha: what is stored behind a transparent pixel is any colour at all.
namespace orbitfuse {

/// Share of the pixels (0..1) that are not wholly opaque, in a PNG, TIFF or BMP; 0 where there is
/// no alpha or the bytes don't decode.
double transparent_share(std::string_view bytes, std::optional<int> page = {});

/// Of one format each; image_codec.hpp tells which it is.
double png_transparent_share(std::string_view bytes);
double tiff_transparent_share(std::string_view bytes, std::optional<int> page);

/// The same of an image (CV_8U or CV_16U) whose last channel is alpha.
double transparent_share(const cv::Mat& image);

}  // namespace orbitfuse
