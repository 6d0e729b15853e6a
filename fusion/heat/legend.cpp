// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/heat/legend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/temperature.hpp"

namespace orbitfuse::fusion {
namespace {

constexpr int font = cv::FONT_HERSHEY_SIMPLEX;
const cv::Scalar mid_gray = cv::Scalar::all(150);

constexpr const char* explanation = "colour: warmer than what is usual here; hatched: not measured";

/// Sizes that follow the strip's width, so that it reads the same under any picture.
struct Layout {
  int width, margin, bar_height, height, swatch;
  double font_scale;
  bool explained;  ///< the explanation is readable at this width

  explicit Layout(int total)
      : width(total),
        margin(std::max(2, total / 40)),
        bar_height(std::max(4, total / 36)),
        height(0),
        swatch(total / 5),
        font_scale(std::max(0.2, total / 1400.0)),
        explained(text_size(explanation).width <= width - 2 * margin) {
    height = 2 * margin + bar_height + (explained ? 2 : 1) * text_height();
  }
  cv::Size text_size(const std::string& text) const {
    int baseline = 0;
    return cv::getTextSize(text, font, font_scale, 1, &baseline);
  }
  int text_height() const { return static_cast<int>(30 * font_scale) + 2; }
  int bar_width() const { return std::max(1, width - 3 * margin - swatch); }
};

void write(cv::Mat& strip, const std::string& text, cv::Point center_top, const Layout& layout) {
  const cv::Size size = layout.text_size(text);
  const int most = layout.width - layout.margin - size.width;
  const int x =
      std::clamp(center_top.x - size.width / 2, layout.margin, std::max(layout.margin, most));
  cv::putText(strip, text, {x, center_top.y + size.height + 2}, font, layout.font_scale,
              cv::Scalar::all(32), 1, cv::LINE_AA);
}

std::string label(double level, HeatUnit unit, bool last) {
  const std::string number =
      fmt::format("{:.0f}", unit == HeatUnit::kelvin ? celsius_from_kelvin(level) : level);
  return last && unit == HeatUnit::kelvin ? number + " C" : number;
}

}  // namespace

Result<cv::Mat> heat_ramp(const HeatLegend& legend, int width) {
  HeatOptions how = legend.how;
  how.scale = legend.scale;
  Plane level(1, std::max(1, width));
  for (int x = 0; x < level.cols; ++x)
    level(0, x) = static_cast<float>(legend.scale.usual + (legend.scale.hot - legend.scale.usual) *
                                                              x / std::max(1, level.cols - 1));
  ORBITFUSE_ASSIGN(cv::Mat colors,
                   colored_by_heat(cv::Mat(level.size(), CV_32FC3, mid_gray), level, {}, how));
  colors.convertTo(colors, CV_8U);
  return colors;
}

Result<cv::Mat> heat_legend(const HeatLegend& legend, int width) {
  HeatOptions how = legend.how;
  how.scale = legend.scale;
  const Layout layout(std::max(width, 1));
  const int bar = layout.bar_width();
  // To the right of the bar the hatching.
  const cv::Size swatches(bar + layout.margin + layout.swatch, layout.bar_height);
  const Plane usual(swatches, static_cast<float>(legend.scale.usual));
  ORBITFUSE_ASSIGN(cv::Mat colors, colored_by_heat(cv::Mat(swatches, CV_32FC3, mid_gray), usual,
                                                   Plane::zeros(swatches), how));
  colors.convertTo(colors, CV_8U);
  ORBITFUSE_ASSIGN(const cv::Mat ramp, heat_ramp(legend, bar));
  cv::repeat(ramp, layout.bar_height, 1, colors.colRange(0, bar));
  colors.colRange(bar, bar + layout.margin).setTo(cv::Scalar::all(255));
  cv::Mat strip(layout.height, layout.width, CV_8UC3, cv::Scalar::all(255));
  const cv::Rect place(layout.margin, layout.margin, swatches.width, swatches.height);
  const cv::Rect inside = place & cv::Rect({}, strip.size());
  if (!inside.empty()) colors(cv::Rect({}, inside.size())).copyTo(strip(inside));
  const int below = place.y + place.height + 2;
  constexpr int ticks = 5;
  for (int i = 0; i < ticks; ++i)
    write(strip,
          (i == 0 ? "usual: " : "") +
              label(legend.scale.usual + (legend.scale.hot - legend.scale.usual) * i / (ticks - 1),
                    legend.unit, i + 1 == ticks),
          {place.x + (bar - 1) * i / (ticks - 1), below}, layout);
  write(strip, "not measured", {place.x + place.width - layout.swatch / 2, below}, layout);
  if (layout.explained) write(strip, explanation, {0, below + layout.text_height()}, layout);
  return strip;
}

Result<cv::Mat> with_heat_legend(const cv::Mat& picture, const HeatLegend& legend) {
  CV_Assert(picture.type() == CV_8UC3);
  ORBITFUSE_ASSIGN(const cv::Mat strip, heat_legend(legend, picture.cols));
  cv::Mat joined;
  cv::vconcat(picture, strip, joined);
  return joined;
}

}  // namespace orbitfuse::fusion
