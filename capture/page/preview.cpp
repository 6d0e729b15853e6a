// SPDX-License-Identifier: BSD-3-Clause
#include "capture/page/preview.hpp"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"

namespace orbitfuse {
namespace {

constexpr std::chrono::milliseconds shortest_life{200};
constexpr std::size_t most_entries = 16;
constexpr int widest_px = 640;

cv::Mat reduced(const cv::Mat& image) {
  if (image.cols <= widest_px) return image;
  cv::Mat small;
  cv::resize(image, small, {widest_px, std::max(1, image.rows * widest_px / image.cols)}, 0, 0,
             cv::INTER_AREA);
  return small;
}

}  // namespace

Result<Preview> PreviewCache::get(const std::filesystem::path& file, Modality modality,
                                  const std::string& palette_name,
                                  std::optional<TemperatureSpan> span) {
  const std::lock_guard lock(mutex_);
  const std::string key = fmt::format("{} {} {:.2f} {:.2f}", name(modality), palette_name,
                                      span ? span->low_k : 0.0, span ? span->high_k : 0.0);
  if (const auto known = entries_.find(key);
      known != entries_.end() && Clock::now() - known->second.made < shortest_life) {
    return known->second.preview;
  }
  Preview preview;
  cv::Mat picture;
  const bool grey = modality == Modality::thermal && file.extension() != ".tiff";
  if (modality == Modality::visible || grey) {
    ORBITFUSE_ASSIGN(picture, grey ? read_image(file) : read_visible(file));
  } else {
    ORBITFUSE_ASSIGN(const cv::Mat colours, palette(palette_name));
    ORBITFUSE_ASSIGN(const cv::Mat kelvin, read_thermal_k(file));
    preview.span = span ? *span : common_span({kelvin});
    picture = colorize(kelvin, *preview.span, colours);
  }
  ORBITFUSE_ASSIGN(preview.jpeg, encode_jpeg(reduced(picture), 80));
  if (entries_.size() >= most_entries) entries_.clear();
  entries_[key] = {preview, Clock::now()};
  return preview;
}

std::optional<double> PreviewCache::kelvin_at(const std::filesystem::path& file, double u,
                                              double v) {
  if (!(u >= 0 && u < 1 && v >= 0 && v < 1) || file.extension() != ".tiff") return std::nullopt;
  const std::lock_guard lock(mutex_);
  if (kelvin_.image.empty() ||
      (kelvin_.file != file && Clock::now() - kelvin_.made >= shortest_life)) {
    Result<cv::Mat> image = read_thermal_k(file);
    if (!image) return std::nullopt;
    kelvin_ = {file, *std::move(image), Clock::now()};
  }
  const float value = kelvin_.image.at<float>(static_cast<int>(v * kelvin_.image.rows),
                                              static_cast<int>(u * kelvin_.image.cols));
  return std::isfinite(value) ? std::optional<double>(value) : std::nullopt;
}

}  // namespace orbitfuse
