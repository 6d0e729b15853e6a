// SPDX-License-Identifier: BSD-3-Clause
#include "capture/image_quality/frame_quality.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "capture/image_quality/edge_blur.hpp"
#include "capture/image_quality/image_noise.hpp"

namespace orbitfuse {
namespace {

constexpr int max_size_px = 640;

double variance(const cv::Mat& image) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0] * deviation[0];
}

/// As CV_32F, scaled so that `side`, one of its sides, has at most `limit` pixels.
cv::Mat at_most(int limit, int side, const cv::Mat& gray) {
  cv::Mat small = gray;
  const double scale = static_cast<double>(limit) / side;
  const auto pixels = [&](int length) { return std::max(1, static_cast<int>(length * scale)); };
  if (scale < 1)
    cv::resize(gray, small, {pixels(gray.cols), pixels(gray.rows)}, 0, 0, cv::INTER_AREA);
  small.convertTo(small, CV_32F);
  return small;
}

}  // namespace

FrameQuality measure_quality(const cv::Mat& image, double kelvin_per_count) {
  CV_Assert(image.type() == CV_8UC3 || image.type() == CV_8UC1 || image.type() == CV_16UC1);
  FrameQuality quality;
  if (image.empty()) return quality;
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  const bool is_thermal = gray.depth() == CV_16U;
  const double total = static_cast<double>(gray.total());
  const double top = is_thermal ? 65535 : 255;
  const int clipped = cv::countNonZero(gray == 0) + cv::countNonZero(gray == top);
  quality.clipped_fraction = clipped / total;

  const cv::Mat valid = is_thermal ? cv::Mat(gray != 0) : cv::Mat();
  const double mean = cv::mean(gray, valid.empty() ? cv::noArray() : cv::InputArray(valid))[0];
  quality.mean_level = is_thermal ? mean * kelvin_per_count : mean;

  const cv::Mat small = at_most(max_size_px, gray.cols, gray);
  cv::Mat laplacian;
  cv::Laplacian(small, laplacian, CV_32F);
  const double spread = variance(small);
  quality.sharpness = spread > 1e-9 ? variance(laplacian) / spread : 0.0;
  return quality;
}

EdgeBlur measure_edges(const cv::Mat& image) {
  CV_Assert(image.type() == CV_8UC3 || image.type() == CV_8UC1 || image.type() == CV_16UC1);
  if (image.empty()) return {};
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  gray = without_dead_pixels(gray);
  return measure_edge_blur(at_most(max_size_px, std::max(gray.cols, gray.rows), gray));
}

}  // namespace orbitfuse
