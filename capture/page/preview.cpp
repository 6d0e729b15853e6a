// SPDX-License-Identifier: BSD-3-Clause
#include "capture/page/preview.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "core/image/image_codec.hpp"
#include "core/image/samples.hpp"
#include "core/image/thermal_counts.hpp"

namespace orbitfuse {
namespace {

constexpr std::chrono::milliseconds shortest_life{200};
constexpr std::size_t most_entries = 16;
constexpr int widest_px = 640;

}  // namespace

Result<Preview> PreviewCache::get(const LatestFrame& frame, const std::string& palette_name,
                                  std::optional<TemperatureSpan> span) {
  const std::lock_guard lock(mutex_);
  const std::string key = fmt::format("{} {} {:.2f} {:.2f}", name(frame.modality), palette_name,
                                      span ? span->low_k : 0.0, span ? span->high_k : 0.0);
  if (const auto known = entries_.find(key);
      known != entries_.end() && Clock::now() - known->second.made < shortest_life) {
    return known->second.preview;
  }
  Preview preview;
  cv::Mat picture;
  if (frame.pixels.depth() == CV_16U) {
    ORBITFUSE_ASSIGN(const cv::Mat colours, palette(palette_name));
    const cv::Mat kelvin = kelvin_of_counts({frame.pixels, frame.scale});
    preview.span = span ? *span : common_span({kelvin});
    picture = colorize(no_wider(kelvin, widest_px, cv::INTER_NEAREST), *preview.span, colours);
  } else {
    picture = no_wider(frame.pixels, widest_px, cv::INTER_AREA);
  }
  ORBITFUSE_ASSIGN(preview.jpeg, encode_jpeg(picture, 80));
  if (entries_.size() >= most_entries) entries_.clear();
  entries_[key] = {preview, Clock::now()};
  return preview;
}

std::optional<double> kelvin_at(const LatestFrame& frame, double u, double v) {
  const cv::Mat& image = frame.pixels;
  if (!(u >= 0 && u < 1 && v >= 0 && v < 1) || image.depth() != CV_16U) return std::nullopt;
  const int count =
      image.at<std::uint16_t>(static_cast<int>(v * image.rows), static_cast<int>(u * image.cols));
  if (count == 0) return std::nullopt;
  return frame.scale.scale * count + frame.scale.offset;
}

}  // namespace orbitfuse
