// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/palette.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"
#include "core/temperature.hpp"

namespace orbitfuse {
namespace {

struct Stop {
  double at;
  std::array<double, 3> rgb;
};

cv::Mat interpolated(const std::vector<Stop>& stops) {
  cv::Mat colors(1, 256, CV_8UC3);
  for (int i = 0; i < 256; ++i) {
    const double at = i / 255.0;
    std::size_t s = 0;
    while (s + 2 < stops.size() && stops[s + 1].at < at) ++s;
    const double w = (at - stops[s].at) / (stops[s + 1].at - stops[s].at);
    for (std::size_t c = 0; c < 3; ++c) {
      const double v = stops[s].rgb[c] + w * (stops[s + 1].rgb[c] - stops[s].rgb[c]);
      colors.at<cv::Vec3b>(0, i)[static_cast<int>(2 - c)] = cv::saturate_cast<unsigned char>(v);
    }
  }
  return colors;
}

cv::Mat opencv_map(int map) {
  cv::Mat levels(1, 256, CV_8UC1), colors;
  for (int i = 0; i < 256; ++i) levels.at<unsigned char>(0, i) = static_cast<unsigned char>(i);
  cv::applyColorMap(levels, colors, map);
  return colors;
}

}  // namespace

std::vector<std::string> palette_names() {
  return {"inferno", "ironbow", "white-hot", "black-hot", "rainbow"};
}

Result<cv::Mat> palette(const std::string& name) {
  if (name == "inferno") return opencv_map(cv::COLORMAP_INFERNO);
  if (name == "rainbow") {
    // OpenCV's begins with red; thermal cameras show red where it is hot.
    cv::Mat colors;
    cv::flip(opencv_map(cv::COLORMAP_RAINBOW), colors, 1);
    return colors;
  }
  if (name == "white-hot") return interpolated({{0, {0, 0, 0}}, {1, {255, 255, 255}}});
  if (name == "black-hot") return interpolated({{0, {255, 255, 255}}, {1, {0, 0, 0}}});
  if (name == "ironbow") {
    // Black, indigo, magenta, orange, yellow, white: glowing iron.
    return interpolated({{0, {0, 0, 0}},
                         {0.14, {32, 0, 140}},
                         {0.32, {148, 7, 156}},
                         {0.5, {214, 61, 67}},
                         {0.68, {244, 128, 6}},
                         {0.86, {255, 211, 34}},
                         {1, {255, 255, 246}}});
  }
  std::string known;
  for (const std::string& n : palette_names()) known += (known.empty() ? "" : ", ") + n;
  return fail(ErrorKind::usage, "palette", "\"" + name + "\" is unknown", "use one of " + known);
}

cv::Mat colorize(const cv::Mat& kelvin, TemperatureSpan span, const cv::Mat& palette_bgr) {
  CV_Assert(kelvin.type() == CV_32FC1 && palette_bgr.type() == CV_8UC3 &&
            palette_bgr.total() == 256);
  const double width = span.high_k - span.low_k;
  const double scale = width > 0 && std::isfinite(width) ? 255.0 / width : 0.0;
  cv::Mat out(kelvin.size(), CV_8UC3, cv::Scalar::all(0));
  for (int y = 0; y < kelvin.rows; ++y) {
    for (int x = 0; x < kelvin.cols; ++x) {
      const double t = kelvin.at<float>(y, x);
      if (std::isnan(t)) continue;
      const double level = std::clamp((t - span.low_k) * scale, 0.0, 255.0);
      out.at<cv::Vec3b>(y, x) = palette_bgr.at<cv::Vec3b>(0, static_cast<int>(std::lround(level)));
    }
  }
  return out;
}

TemperatureSpan common_span(const std::vector<cv::Mat>& kelvin_images, double low_percentile,
                            double high_percentile) {
  std::vector<float> samples;
  for (const cv::Mat& image : kelvin_images) append_finite(image, samples);
  TemperatureSpan span{celsius_zero_k, celsius_zero_k};  // without a sample: any defined span
  if (!samples.empty()) {
    span.low_k = quantile(samples, std::clamp(low_percentile, 0.0, 100.0) / 100);
    span.high_k = quantile(samples, std::clamp(high_percentile, 0.0, 100.0) / 100);
  }
  constexpr double min_width_k = 0.5;  // below it a palette would show nothing but noise
  if (span.high_k - span.low_k < min_width_k) {
    const double middle = 0.5 * (span.low_k + span.high_k);
    span = {middle - min_width_k / 2, middle + min_width_k / 2};
  }
  return span;
}

}  // namespace orbitfuse
