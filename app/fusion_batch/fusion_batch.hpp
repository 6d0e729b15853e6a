// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "fusion/fuse/fuse.hpp"

namespace orbitfuse::batch {

inline constexpr const char* metrics_file = "metrics.csv";

struct Summary {
  int fused = 0;
  std::vector<std::string> problems;  ///< pairs that could not be fused, and why
  std::vector<std::string> remarks;   ///< on images that were fused all the same
};

/// Any image (core's read_image), upright as its EXIF data say.
Result<cv::Mat> read_photo(const std::filesystem::path& file);

/// Thermal image of a file: one channel of 16 bits is radiometric and becomes kelvin (NaN =
/// invalid), anything else stays as stored.
Result<cv::Mat> read_thermal(const std::filesystem::path& file);

/// Sentences on what of an image's file is not used: alpha, pages of another size.
std::vector<std::string> unused_parts(const std::filesystem::path& file);

/// A sentence where the visible image looks like counts of temperature and the thermal one like a
/// photo: an industrial camera and a palette's picture do so too.
std::optional<std::string> looks_exchanged(const cv::Mat& visible, const cv::Mat& thermal,
                                           const std::filesystem::path& visible_file);

/// A sentence where thermal images are in colour, of which `first` is the first; none for 0.
std::optional<std::string> in_colors(std::size_t count, const std::filesystem::path& first);
/// The same of one image as it was read.
std::optional<std::string> in_colors(const cv::Mat& thermal, const std::filesystem::path& file);

/// The 8-bit image in which it is fused and scored: kelvin over `span` (none: their own), anything
/// else as it is.
Result<cv::Mat> gray_of_thermal(const cv::Mat& thermal, const std::optional<TemperatureSpan>& span);

/// An error of fuse() or fusion_metrics() that names one of the images, with that image's file.
Error with_file(Error error, const std::map<std::string, std::string>& files);

/// Fuses the images of equal stem in two folders into out/vi, out/ir and out/fused (all PNG, equal
/// names: the aligned-pairs layout that fusion networks train on) and writes out/metrics.csv. A bad
/// pair, a stem that several images of a folder share and one without a partner are told and left
/// out. Input error when no pair could be fused.
Result<Summary> fuse_folder(const std::filesystem::path& visible,
                            const std::filesystem::path& thermal, const std::filesystem::path& out,
                            const FusionOptions& options, const Progress& progress);

}  // namespace orbitfuse::batch
