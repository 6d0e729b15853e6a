// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/metrics/planes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace orbitfuse::metrics {

Result<std::vector<Plane>> planes_of(const cv::Mat& image, const std::string& name) {
  if (image.empty())
    return fail(ErrorKind::input, name, "empty image", "give an image with pixels");
  double scale = 1;
  switch (image.depth()) {
    case CV_8U:
    case CV_32F:
    case CV_64F:
      break;
    case CV_16U:
      scale = 255.0 / 65535.0;
      break;
    default:
      return fail(ErrorKind::input, name, "samples of an unknown type",
                  "give 8- or 16-bit or float samples");
  }
  if (image.channels() != 1 && image.channels() != 3) {
    return fail(ErrorKind::input, name, fmt::format("{} channels", image.channels()),
                "give 1 or 3 channels");
  }
  cv::Mat samples;
  image.convertTo(samples, CV_64F, scale);
  std::vector<cv::Mat> channels;
  cv::split(samples, channels);
  std::vector<Plane> planes(channels.begin(), channels.end());
  if (image.depth() != CV_32F && image.depth() != CV_64F) return planes;  // always finite
  for (const Plane& plane : planes) {
    if (!cv::checkRange(plane)) {
      return fail(ErrorKind::input, name, "samples that are not finite", "mask or fill them first");
    }
  }
  return planes;
}

Result<std::vector<std::vector<Plane>>> matched_planes(const std::vector<cv::Mat>& images,
                                                       const std::vector<std::string>& names,
                                                       int min_side) {
  std::vector<std::vector<Plane>> all;
  std::size_t channels = 1;
  for (std::size_t i = 0; i < images.size(); ++i) {
    ORBITFUSE_ASSIGN(std::vector<Plane> planes, planes_of(images[i], names[i]));
    if (images[i].size() != images[0].size()) {
      return fail(ErrorKind::input, names[i],
                  fmt::format("{}x{}, but {} is {}x{}", images[i].cols, images[i].rows, names[0],
                              images[0].cols, images[0].rows),
                  "register or resize the images first");
    }
    channels = std::max(channels, planes.size());
    all.push_back(std::move(planes));
  }
  if (std::min(images[0].cols, images[0].rows) < min_side) {
    return fail(ErrorKind::input, names[0], fmt::format("{}x{}", images[0].cols, images[0].rows),
                fmt::format("at least {0}x{0} is needed", min_side));
  }
  for (auto& planes : all) planes.resize(channels, planes[0]);
  return all;
}

Plane stretched(const Plane& plane) {
  double low = 0, high = 0;
  cv::minMaxLoc(plane, &low, &high);
  Plane out(plane.size(), 0.0);
  if (high == low) return out;
  const double span = high - low;
  for (int y = 0; y < plane.rows; ++y) {
    const double* from = plane[y];
    std::transform(from, from + plane.cols, out[y],
                   [=](double v) { return std::floor((v - low) / span * 255 + 0.5); });
  }
  return out;
}

}  // namespace orbitfuse::metrics
