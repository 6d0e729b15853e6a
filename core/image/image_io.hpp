// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/result.hpp"

// Errors of reading are input errors and name the file, those of writing device errors (the disk,
// an encoder that refuses).
namespace orbitfuse {

/// 8-bit BGR (CV_8UC3). EXIF orientation is applied. JPEG and PNG; truncated files, other content
/// under the extension and 16-bit samples are input errors that name the file.
Result<cv::Mat> read_visible(const std::filesystem::path& path);

/// Kelvin (CV_32FC1, NaN = invalid) from a 16-bit TIFF or PNG. The scale comes from the file's own
/// tag, else from its sidecar <file>.json, else centikelvin is assumed.
Result<cv::Mat> read_thermal_k(const std::filesystem::path& path);

/// Any image as stored, without EXIF orientation: CV_8U or CV_16U, 1 or 3 channels (BGR; alpha is
/// dropped). JPEG, PNG, BMP, TIFF. For metrics and fusion on files.
Result<cv::Mat> read_image(const std::filesystem::path& path);

/// Encoders; all writes are atomic. CV_8U, PNG CV_16U too, 1 or 3 channels (BGR). `quality`:
/// 0..100.
Status write_png(const std::filesystem::path& path, const cv::Mat& image);
Status write_jpeg(const std::filesystem::path& path, const cv::Mat& image, int quality = 95);
/// The finest stored scale (core/temperature.hpp) that holds every temperature of the images.
double kelvin_per_count_for(const std::vector<cv::Mat>& kelvin_images);
/// CV_16UC1 of kelvin (CV_32FC1); 0 = invalid or outside the scale.
cv::Mat counts_of_kelvin(const cv::Mat& kelvin, double kelvin_per_count);
/// 16-bit TIFF with the scale in ImageDescription, and its sidecar. Without a scale the finest that
/// holds the image: 0.01 K a count (centikelvin) up to 382 C.
Status write_thermal_tiff(const std::filesystem::path& path, const cv::Mat& kelvin,
                          std::optional<double> kelvin_per_count = {});
/// 32-bit float TIFF of CV_32FC1 (depth, opacity), NaN and infinite kept. Reading anything else is
/// an input error.
Status write_float_tiff(const std::filesystem::path& path, const cv::Mat& values);
Result<cv::Mat> read_float_tiff(const std::filesystem::path& path);

}  // namespace orbitfuse
