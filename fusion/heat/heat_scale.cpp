// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/heat/heat_scale.hpp"

#include <algorithm>
#include <cmath>

#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {

/// Of how unusual a level is; below 1 what is moderately warm shows too.
constexpr double exponent = 0.7;

}  // namespace

double HeatScale::strength(double level) const {
  const double above = level - usual;
  if (!(above > 0)) return 0;
  const double height = std::pow(std::min(1.0, above / (hot - usual)), exponent);
  return spread > 0 ? height * -std::expm1(-above / spread) : height;
}

bool HeatScale::is_valid() const {
  return std::isfinite(usual) && std::isfinite(hot) && std::isfinite(hot - usual) && hot > usual &&
         spread >= 0 && std::isfinite(spread);
}

HeatScale within_levels(HeatScale scale, const HeatScaleOptions& options) {
  scale.hot = std::max(std::min(scale.hot, options.highest), scale.usual + options.min_width);
  return scale;
}

HeatScale heat_scale(const std::vector<cv::Mat>& images, const HeatScaleOptions& options) {
  std::vector<float> samples;
  for (const cv::Mat& image : images) append_finite(image, samples);
  if (samples.empty()) return {0, 0, options.min_width};
  const auto at = [&](double share) -> double { return quantile(samples, share); };
  HeatScale scale;
  scale.usual = at(0.5);
  scale.spread = std::min(scale.usual - at(0.25), at(0.75) - scale.usual);
  scale.hot = at(1 - options.hotter_share);
  scale = within_levels(scale, options);
  // Levels so large that a double can't tell them from their neighbour `min_width` away.
  if (!(scale.hot > scale.usual)) scale.hot = std::nextafter(scale.usual, 1e300);
  return scale;
}

}  // namespace orbitfuse
