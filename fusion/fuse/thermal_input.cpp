// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fuse/thermal_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace orbitfuse {
namespace {

using fusion::Plane;

Result<ThermalGray> gray_of_floats(const cv::Mat1f& thermal,
                                   const std::optional<TemperatureSpan>& wanted) {
  const TemperatureSpan span = wanted ? *wanted : common_span({thermal});
  if (!(std::isfinite(span.low_k) && std::isfinite(span.high_k) && span.high_k > span.low_k))
    return fail(ErrorKind::usage, "span", fmt::format("{} to {}", span.low_k, span.high_k),
                "must rise and be finite");
  ThermalGray result{Plane(thermal.size()), cv::Mat1b(thermal.size())};
  const double scale = 255 / (span.high_k - span.low_k);
  for (int y = 0; y < thermal.rows; ++y)
    for (int x = 0; x < thermal.cols; ++x) {
      const double value = static_cast<double>(thermal(y, x));
      const bool valid = std::isfinite(value);
      result.valid(y, x) = valid ? 255 : 0;
      result.gray(y, x) =
          valid ? static_cast<float>(std::clamp((value - span.low_k) * scale, 0.0, 255.0)) : 0.0F;
    }
  const int count = cv::countNonZero(result.valid);
  if (count == 0)
    return fail(ErrorKind::input, "thermal", "no finite sample", "give an image with temperatures");
  if (count == static_cast<int>(thermal.total())) result.valid.release();
  return result;
}

}  // namespace

Result<cv::Mat> floats_of(const cv::Mat& image, const char* which) {
  if ((image.depth() != CV_8U && image.depth() != CV_16U) ||
      (image.channels() != 1 && image.channels() != 3))
    return fail(ErrorKind::input, which,
                fmt::format("{} channels of OpenCV depth {}", image.channels(), image.depth()),
                "give 8- or 16-bit samples, gray or BGR (thermal: floats as well)");
  cv::Mat floats;
  image.convertTo(floats, CV_32F, image.depth() == CV_16U ? 255.0 / 65535.0 : 1.0);
  return floats;
}

Plane luma(const cv::Mat& floats) {
  if (floats.channels() == 1) return floats;
  Plane gray;
  cv::cvtColor(floats, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

Result<ThermalGray> thermal_gray(const cv::Mat& thermal,
                                 const std::optional<TemperatureSpan>& span) {
  if (thermal.type() == CV_32FC1 && !thermal.empty()) return gray_of_floats(thermal, span);
  ORBITFUSE_ASSIGN(const cv::Mat floats, floats_of(thermal, "thermal"));
  return ThermalGray{luma(floats), {}};
}

}  // namespace orbitfuse
