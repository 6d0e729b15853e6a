// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/heat/heat.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/image/palette.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse::fusion {
namespace {

/// Share of the palette left out at its dark end: a faint dark tint reads as a shadow, not as
/// warmth.
constexpr double dark_share = 0.35;

struct Coloring {
  HeatScale scale;
  std::array<cv::Vec3f, 256> colors;
  double opacity, shading, hatching;
  int hatch_period;
};

/// Of one pixel; `known` is 0..1. The palette is read by the level's share of the way from usual to
/// hot; its strength is the opacity alone.
cv::Vec3f colored_pixel(const cv::Vec3f& visible, double level, double known, const Coloring& how) {
  if (!(known > 0)) return visible;
  const double share =
      std::clamp((level - how.scale.usual) / (how.scale.hot - how.scale.usual), 0.0, 1.0);
  const auto weight = static_cast<float>(known * how.opacity * how.scale.strength(level));
  const double luma = 0.114 * visible[0] + 0.587 * visible[1] + 0.299 * visible[2];
  const auto shade =
      static_cast<float>(1 - how.shading + how.shading * std::clamp(luma / 255, 0.0, 1.0));
  const cv::Vec3f color = how.colors[static_cast<std::size_t>(std::lround(255 * share))] * shade;
  return visible + weight * (color - visible);
}

int hatch_period_of(int width) { return std::max(8, width / 50); }

/// Darker and brighter stripes, so that they show on black and on white.
cv::Vec3f hatched(const cv::Vec3f& pixel, int x, int y, double unknown, const Coloring& how) {
  const double luma = (pixel[0] + pixel[1] + pixel[2]) / 3;
  const auto step = static_cast<float>((luma < 128 ? 255 : -255) * how.hatching * unknown);
  return on_hatching(x, y, how.hatch_period) ? pixel + cv::Vec3f::all(step) : pixel;
}

}  // namespace

bool on_hatching(int x, int y, int period) { return (x + y) % period < std::max(1, period / 6); }

void hatch_unmeasured(cv::Mat& painted_bgr, const cv::Mat& levels) {
  CV_Assert(painted_bgr.type() == CV_8UC3 && levels.type() == CV_32FC1 &&
            levels.size() == painted_bgr.size());
  constexpr std::uint8_t plain = 128, stripe = 96;
  const int period = hatch_period_of(painted_bgr.cols);
  for (int y = 0; y < levels.rows; ++y)
    for (int x = 0; x < levels.cols; ++x)
      if (!std::isfinite(levels.at<float>(y, x)))
        painted_bgr.at<cv::Vec3b>(y, x) =
            cv::Vec3b::all(on_hatching(x, y, period) ? stripe : plain);
}

Status HeatOptions::validate() const {
  ORBITFUSE_TRY(orbitfuse::palette(palette));
  for (const auto& [field, value] :
       {std::pair{"opacity", opacity}, {"shading", shading}, {"hatching", hatching}})
    if (!(value >= 0 && value <= 1))
      return fail(ErrorKind::usage, std::string("heat.") + field, fmt::format("{}", value),
                  "must be in 0..1");
  if (scale && !scale->is_valid())
    return fail(ErrorKind::usage, "heat.scale", fmt::format("{} to {}", scale->usual, scale->hot),
                "must rise and be finite");
  return {};
}

Result<cv::Mat> heat_colors(const std::string& name) {
  ORBITFUSE_ASSIGN(const cv::Mat whole, orbitfuse::palette(name));
  cv::Mat colors(1, 256, CV_8UC3);
  for (int i = 0; i < 256; ++i) {
    const double at = 255 * dark_share + (1 - dark_share) * i;
    colors.at<cv::Vec3b>(0, i) = whole.at<cv::Vec3b>(0, static_cast<int>(std::lround(at)));
  }
  return colors;
}

Result<cv::Mat> colored_by_heat(const cv::Mat& visible, const Plane& thermal, const Plane& measured,
                                const HeatOptions& options) {
  ORBITFUSE_TRY(options.validate());
  CV_Assert(visible.type() == CV_32FC3 && thermal.size() == visible.size() &&
            (measured.empty() || measured.size() == visible.size()));
  const auto known = [&](int y, int x) {
    if (!std::isfinite(thermal(y, x))) return 0.0;
    return measured.empty() ? 1.0 : static_cast<double>(measured(y, x));
  };
  Coloring how{
      {}, {}, options.opacity, options.shading, options.hatching, hatch_period_of(visible.cols)};
  if (options.scale) {
    how.scale = *options.scale;
  } else {
    Plane seen = thermal.clone();
    if (!measured.empty()) seen.setTo(std::numeric_limits<float>::quiet_NaN(), measured <= 0);
    how.scale = heat_scale({seen});
  }
  ORBITFUSE_ASSIGN(const cv::Mat colors, heat_colors(options.palette));
  for (int i = 0; i < 256; ++i)
    how.colors[static_cast<std::size_t>(i)] = colors.at<cv::Vec3b>(0, i);
  cv::Mat result(visible.size(), CV_32FC3);
  parallel_blocks(visible.rows, 32, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < visible.cols; ++x) {
        const double share = known(y, x);
        const cv::Vec3f shown = colored_pixel(visible.at<cv::Vec3f>(y, x),
                                              static_cast<double>(thermal(y, x)), share, how);
        result.at<cv::Vec3f>(y, x) = share < 1 ? hatched(shown, x, y, 1 - share, how) : shown;
      }
  });
  return result;
}

}  // namespace orbitfuse::fusion
