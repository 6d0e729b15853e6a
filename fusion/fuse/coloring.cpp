// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/coloring.hpp"

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "core/image/palette.hpp"

namespace orbitfuse {
namespace {

/// Chroma of float images is centred on 0.5; the centre cancels as long as both ways go through it.
cv::Mat ycrcb_of(const cv::Mat& bgr) {
  cv::Mat result;
  cv::cvtColor(bgr, result, cv::COLOR_BGR2YCrCb);
  return result;
}

Result<cv::Mat> palette_colors(const fusion::Plane& gray, const std::string& name) {
  ORBITFUSE_ASSIGN(const cv::Mat colors, palette(name));
  cv::Mat bytes, triple, bgr, floats;
  gray.convertTo(bytes, CV_8U);
  cv::merge(std::vector<cv::Mat>(3, bytes), triple);
  cv::LUT(triple, colors, bgr);
  bgr.convertTo(floats, CV_32F);
  return floats;
}

}  // namespace

Status TemperatureOverlay::validate() const {
  if (!palette.empty()) ORBITFUSE_TRY(orbitfuse::palette(palette));
  if (!(strength >= 0 && strength <= 1))
    return fail(ErrorKind::usage, "overlay.strength", fmt::format("{}", strength),
                "must be in 0..1");
  return {};
}

Result<cv::Mat> colored(const fusion::Plane& fused, const cv::Mat& visible,
                        const fusion::Plane& thermal, const fusion::Plane& measured,
                        const TemperatureOverlay& overlay) {
  cv::Mat bgr = visible;
  if (visible.channels() == 1) cv::cvtColor(visible, bgr, cv::COLOR_GRAY2BGR);
  cv::Mat result = ycrcb_of(bgr);
  if (!overlay.palette.empty()) {
    ORBITFUSE_ASSIGN(const cv::Mat colors, palette_colors(thermal, overlay.palette));
    cv::Mat strength(result.size(), CV_32FC1, overlay.strength), change = ycrcb_of(colors) - result;
    if (!measured.empty()) strength = strength.mul(measured);
    cv::merge(std::vector<cv::Mat>(3, strength), strength);
    result += change.mul(strength);
  }
  cv::insertChannel(fused, result, 0);
  cv::cvtColor(result, result, cv::COLOR_YCrCb2BGR);
  return result;
}

}  // namespace orbitfuse
