// SPDX-License-Identifier: BSD-3-Clause
#include "app/fusion_batch/fusion_batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/image/exif.hpp"
#include "core/image/has_colors.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"
#include "core/image/transparency.hpp"
#include "core/system/file_io.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse::batch {
namespace {
namespace fs = std::filesystem;

/// No file where several have a stem: they would be written over each other.
Result<std::map<std::string, fs::path>> files_by_stem(const fs::path& folder,
                                                      std::vector<std::string>& problems) {
  std::error_code error, no_file;
  std::map<std::string, std::vector<fs::path>> all;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const bool sidecar = at->path().extension() == ".json";  // of a thermal TIFF
    if (!sidecar && at->is_regular_file(no_file)) all[at->path().stem().string()].push_back(*at);
  }
  if (error)
    return fail(ErrorKind::input, folder.string(), error.message(),
                "give two folders, or two images");
  std::map<std::string, fs::path> files;
  for (auto& [stem, list] : all) {
    std::sort(list.begin(), list.end());
    files[stem] = list.size() == 1 ? list.front() : fs::path();
    if (list.size() > 1)
      problems.push_back(fmt::format("{}: {} is another image of that name; left out",
                                     list[0].string(), list[1].filename().string()));
  }
  return files;
}

/// One pair into the layout; its lines of the CSV.
Result<std::string> fuse_one(const std::string& stem, const fs::path& visible_file,
                             const fs::path& thermal_file, const fs::path& out,
                             const FusionOptions& options, std::vector<std::string>& remarks,
                             std::vector<fs::path>& colored) {
  ORBITFUSE_ASSIGN(const cv::Mat visible, read_photo(visible_file));
  ORBITFUSE_ASSIGN(const cv::Mat stored, read_thermal(thermal_file));
  ORBITFUSE_ASSIGN(const cv::Mat fused, fuse(visible, stored, {}, options));
  ORBITFUSE_ASSIGN(const cv::Mat thermal, gray_of_thermal(stored, options.span));
  ORBITFUSE_ASSIGN(const auto values, fusion_metrics(visible, thermal, fused));
  ORBITFUSE_TRY(write_png(out / "vi" / (stem + ".png"), visible));
  ORBITFUSE_TRY(write_png(out / "ir" / (stem + ".png"), thermal));
  ORBITFUSE_TRY(write_png(out / "fused" / (stem + ".png"), fused));
  for (const fs::path& file : {visible_file, thermal_file})
    for (std::string& remark : unused_parts(file)) remarks.push_back(std::move(remark));
  if (auto remark = looks_exchanged(visible, stored, visible_file))
    remarks.push_back(*std::move(remark));
  if (has_colors(stored)) colored.push_back(thermal_file);
  std::string lines;
  for (const MetricValue& v : values)
    lines += fmt::format("{},{},{},{}\n", stem, name(options.method), v.name, v.value);
  return lines;
}

}  // namespace

Result<cv::Mat> read_photo(const fs::path& file) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(file, max_image_bytes));
  ORBITFUSE_ASSIGN(const cv::Mat image, decode_image(bytes, file.string()));
  return apply_orientation(image, read_exif(bytes).orientation);
}

Result<cv::Mat> read_thermal(const fs::path& file) {
  ORBITFUSE_ASSIGN(const cv::Mat image, read_image(file));
  if (image.type() != CV_16UC1) return read_photo(file);
  ORBITFUSE_ASSIGN(const cv::Mat kelvin, read_thermal_k(file));
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(file, max_image_bytes));
  return apply_orientation(kelvin, read_exif(bytes).orientation);
}

std::optional<std::string> looks_exchanged(const cv::Mat& visible, const cv::Mat& thermal,
                                           const fs::path& visible_file) {
  if (visible.type() != CV_16UC1 || thermal.channels() == 1) return std::nullopt;
  return visible_file.string() +
         ": 16-bit grey as the visible image beside a thermal one in colour; if that is a mistake, "
         "exchange the two";
}

std::optional<std::string> in_colors(std::size_t count, const fs::path& first) {
  if (count == 0) return std::nullopt;
  return fmt::format(
      "{}{}: in colour, so a palette's picture or a photograph: the colours of a palette are no "
      "temperatures, only their brightness is used; give the camera's radiometric files, or gray "
      "levels",
      first.string(), count == 1 ? "" : fmt::format(" and {} more thermal images", count - 1));
}

std::optional<std::string> in_colors(const cv::Mat& thermal, const fs::path& file) {
  return in_colors(has_colors(thermal) ? 1 : 0, file);
}

std::vector<std::string> unused_parts(const fs::path& file) {
  std::vector<std::string> list;
  const auto bytes = read_file(file, max_image_bytes);
  if (!bytes) return list;  // whoever decodes it says why
  if (const double share = transparent_share(*bytes); share > 0)
    list.push_back(fmt::format(
        "{}: {:.3g} % of its pixels are transparent; alpha is dropped, and what colour lies behind "
        "it counts as seen: give the image as it was taken",
        file.string(), 100 * share));
  const bool tiff = image_format(*bytes) == ImageFormat::tiff;
  if (const std::string pages = tiff ? other_tiff_pages(*bytes) : ""; !pages.empty())
    list.push_back(fmt::format("left out: {}: {}", file.string(), pages));
  return list;
}

Error with_file(Error error, const std::map<std::string, std::string>& files) {
  const auto named = files.find(error.where);
  if (named != files.end()) error.where += " " + named->second;
  return error;
}

Result<cv::Mat> gray_of_thermal(const cv::Mat& thermal,
                                const std::optional<TemperatureSpan>& span) {
  if (thermal.depth() != CV_32F) return thermal;
  ORBITFUSE_ASSIGN(const ThermalGray gray, thermal_gray(thermal, span));
  cv::Mat bytes;
  gray.gray.convertTo(bytes, CV_8U);
  return bytes;
}

Result<Summary> fuse_folder(const fs::path& visible, const fs::path& thermal, const fs::path& out,
                            const FusionOptions& options, const Progress& progress) {
  std::error_code unreadable;
  for (const fs::path& folder : {visible, thermal})
    if (!fs::is_directory(folder, unreadable))
      return fail(ErrorKind::input, folder.string(), "not a folder",
                  "give two folders, or two images");
  Summary summary;
  ORBITFUSE_ASSIGN(const auto thermal_files, files_by_stem(thermal, summary.problems));
  ORBITFUSE_ASSIGN(const auto visible_files, files_by_stem(visible, summary.problems));
  for (const auto& [stem, file] : thermal_files)
    if (!visible_files.contains(stem))
      summary.problems.push_back(file.string() + ": no visible image of that name");
  std::vector<fs::path> colored;
  std::string csv = "pair,method,metric,value\n";
  int done = 0;
  for (const auto& [stem, file] : visible_files) {
    ORBITFUSE_TRY(progress.check("fuse"));
    progress.report(
        {"fuse", static_cast<double>(done++), static_cast<double>(visible_files.size()), {}, stem});
    const auto partner = thermal_files.find(stem);
    if (file.empty() || (partner != thermal_files.end() && partner->second.empty())) continue;
    if (partner == thermal_files.end()) {
      summary.problems.push_back(file.string() + ": no thermal image of that name");
      continue;
    }
    const auto lines =
        fuse_one(stem, file, partner->second, out, options, summary.remarks, colored);
    if (!lines) {
      summary.problems.push_back(stem + ": " + lines.error().message());
      continue;
    }
    csv += *lines;
    ++summary.fused;
  }
  if (auto remark = in_colors(colored.size(), colored.empty() ? "" : colored.front()))
    summary.remarks.push_back(*std::move(remark));
  if (summary.fused == 0)
    return fail(ErrorKind::input, visible.string(),
                summary.problems.empty() ? "no images"
                                         : "no pair could be fused; " + summary.problems.front(),
                "pairs need equal file names and sizes");
  ORBITFUSE_TRY(write_file_atomic(out / metrics_file, csv));
  return summary;
}

}  // namespace orbitfuse::batch
