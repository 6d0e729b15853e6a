// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/raw_counts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace orbitfuse {
namespace {

/// Between the 0.1 and 99.9 percentiles, widened by half of that to each side.
std::pair<double, double> roomy_range(const cv::Mat& counts) {
  std::vector<std::uint16_t> sorted(counts.begin<std::uint16_t>(), counts.end<std::uint16_t>());
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double share) {
    return static_cast<double>(
        sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))]);
  };
  const double low = at(0.001), high = std::max(at(0.999), low + 1), room = 0.5 * (high - low);
  return {std::max(0.0, low - room), std::min(65535.0, high + room)};
}

}  // namespace

std::optional<std::string> RawCounts::apply(Frame& frame) {
  std::optional<std::string> words;
  if (!range_) {
    range_ = roomy_range(frame.pixels);
    words = fmt::format(
        "counts of unknown scale: no temperatures; shown as gray, 0 at {:.0f} and 255 at {:.0f} "
        "counts; "
        "the counts themselves are in thermal/originals",
        range_->first, range_->second);
  }
  const double scale = 255 / (range_->second - range_->first);
  frame.original = frame.pixels;
  cv::Mat gray;
  frame.original.convertTo(gray, CV_8U, scale, -scale * range_->first);
  frame.pixels = gray;
  frame.thermal_is_gray = true;
  if (std::find(frame.flags.begin(), frame.flags.end(), "raw-counts") == frame.flags.end())
    frame.flag(FrameFlag::raw_counts);
  return words;
}

}  // namespace orbitfuse
