// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/thermal_samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <utility>

namespace orbitfuse {
namespace {

constexpr double hottest_stored_k = 65535 * stored_kelvin_per_count.back();

}  // namespace

ThermalSamples ThermalSamples::linear(double kelvin_per_sample) {
  ThermalSamples samples;
  samples.kelvin_per_sample_ = samples.kelvin_per_count_ = kelvin_per_sample;
  return samples;
}

ThermalSamples ThermalSamples::table(std::vector<double> kelvin) {
  assert(kelvin.size() == 65536);
  ThermalSamples samples;
  samples.kelvin_ = std::move(kelvin);
  return samples;
}

void ThermalSamples::store_no_finer_than(double kelvin_per_count) {
  if (!kelvin_.empty()) kelvin_per_count_ = std::max(kelvin_per_count_, kelvin_per_count);
}

/// Returns how many samples were too hot to say.
int ThermalSamples::to_counts(Frame& frame, int full_scale) {
  cv::Mat& pixels = frame.pixels;
  const cv::Mat clipped = pixels >= full_scale;
  int count = cv::countNonZero(clipped);
  if (kelvin_.empty()) {
    frame.kelvin_per_count = kelvin_per_sample_;
    if (count > 0) pixels.setTo(0, clipped);
    return count;
  }
  double hottest_k = 0;
  std::for_each(pixels.begin<std::uint16_t>(), pixels.end<std::uint16_t>(), [&](auto sample) {
    // What no scale holds decides nothing: it is not stored in any case.
    if (sample < full_scale && kelvin_[sample] > hottest_k && kelvin_[sample] <= hottest_stored_k)
      hottest_k = kelvin_[sample];
  });
  store_no_finer_than(kelvin_per_count_for(hottest_k));
  frame.kelvin_per_count = kelvin_per_count_;
  std::transform(pixels.begin<std::uint16_t>(), pixels.end<std::uint16_t>(),
                 pixels.begin<std::uint16_t>(), [&](std::uint16_t sample) {
                   if (sample >= full_scale) return std::uint16_t{0};
                   const double kelvin = kelvin_[sample];
                   const auto stored = count_from_kelvin(kelvin, frame.kelvin_per_count);
                   count += stored == 0 && kelvin > 65535 * frame.kelvin_per_count;
                   return stored;
                 });
  return count;
}

std::optional<std::string> ThermalSamples::apply(Frame& frame, int full_scale,
                                                 std::string_view remedy) {
  const int clipped = to_counts(frame, full_scale);
  if (clipped == 0) return std::nullopt;
  frame.flag(FrameFlag::clipped);
  if (std::exchange(told_, true)) return std::nullopt;
  const double end_k = kelvin_.empty() ? kelvin_per_sample_ * full_scale
                                       : kelvin_[static_cast<std::size_t>(full_scale) - 1];
  return fmt::format(
      "{} samples at the end of the camera's scale{}: dead pixels, here and in all frames with the "
      "flag clipped; {}",
      clipped,
      std::isfinite(end_k) ? fmt::format(" ({:.0f} C or hotter)", celsius_from_kelvin(end_k)) : "",
      remedy);
}

}  // namespace orbitfuse
