// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"

// Codecs on bytes; image_io.hpp works on files. `where` names the file in errors.
namespace orbitfuse {

enum class ImageFormat { jpeg, png, tiff, bmp, unknown };
ImageFormat image_format(std::string_view bytes);
const char* name(ImageFormat format);
/// "a HEIC image" and the like for content that is known but not read; null otherwise.
const char* name_of_other_format(std::string_view bytes);

/// As stored, without EXIF orientation: CV_8U/CV_16U, 1 or 3 channels (BGR; alpha is dropped).
/// A truncated or damaged file is an input error, even where a decoder would fill in grey.
Result<cv::Mat> decode_image(std::string_view bytes, const std::string& where);

/// Stored to upright for EXIF orientation 1..8.
cv::Mat apply_orientation(const cv::Mat& image, int orientation);

/// T[K] = scale DN + offset, from a TIFF's ImageDescription or a sidecar's text.
struct ThermalScaleTag {
  double scale = 0.01, offset = 0;
};
/// Nothing where the text names no scale (many programs write something into ImageDescription); an
/// input error where it names one that can't be used, has a key twice, or names another count than
/// 0 as invalid.
Result<std::optional<ThermalScaleTag>> thermal_scale_of_description(std::string_view text,
                                                                    const std::string& where);
/// A sidecar is there for its scale: without one it is an input error.
Result<ThermalScaleTag> thermal_scale_of_sidecar(std::string_view text, const std::string& where);

/// Images of the first one's size and samples in a TIFF; masks and reduced copies don't count.
/// Nothing where it can't be read.
std::optional<int> tiff_page_count(std::string_view bytes);
/// A sentence on pages of another size or kind of samples, which decode_tiff() does not read; empty
/// where there is none. No tag says whether they are previews or another camera's images.
std::string other_tiff_pages(std::string_view bytes);
/// How the page (none: the first) that decode_tiff() reads is to be turned, 1..8: a copy in front
/// of it has a tag of its own. Nothing where it can't be read.
std::optional<int> tiff_orientation(std::string_view bytes, std::optional<int> page = {});
/// 8/16-bit unsigned or 32-bit float samples, one channel or RGB (returned as BGR); other colours
/// (a palette, CMYK, Lab, planes) are refused by name. Without a page the file must hold a single
/// one: nobody asked for the first of several. Where the ImageDescription names no scale, GDAL's
/// scale and offset stand in it.
Result<cv::Mat> decode_tiff(std::string_view bytes, const std::string& where,
                            std::string* image_description = nullptr, std::optional<int> page = {});
/// CV_16UC1 or CV_32FC1, deflate with the fitting predictor (lossless).
Result<std::string> encode_tiff(const cv::Mat& image, const std::string& image_description);
Result<cv::Mat> decode_jpeg(std::string_view bytes, const std::string& where);
/// Palettes become colours, alpha is dropped, 16-bit samples keep their counts.
Result<cv::Mat> decode_png(std::string_view bytes, const std::string& where);
Result<std::string> encode_png(const cv::Mat& image);
Result<std::string> encode_jpeg(const cv::Mat& image, int quality);

/// The thermal TIFF of a session from CV_16UC1 counts, 0 = invalid, and its sidecar's text.
Result<std::string> encode_thermal_tiff(const cv::Mat& counts, ThermalScaleTag scale = {});
std::string thermal_sidecar_json(ThermalScaleTag scale = {});

/// A bigger image is refused before memory is taken for it.
inline constexpr long long max_image_samples = 400'000'000;

}  // namespace orbitfuse
