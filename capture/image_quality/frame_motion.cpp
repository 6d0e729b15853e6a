// SPDX-License-Identifier: BSD-3-Clause
#include "capture/image_quality/frame_motion.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "capture/image_quality/image_noise.hpp"

namespace orbitfuse {
namespace {

constexpr int width_px = 160;      // half a percent of the width is most of a pixel there
constexpr double smooth_px = 1.5;  // so that a slope lasts as long as the shifts asked for

cv::Mat small_gray(const cv::Mat& image) {
  cv::Mat gray = without_dead_pixels(image), small;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  const double scale = std::min(1.0, static_cast<double>(width_px) / gray.cols);
  const auto pixels = [&](int side) { return std::max(1, static_cast<int>(side * scale)); };
  cv::resize(gray, small, {pixels(gray.cols), pixels(gray.rows)}, 0, 0, cv::INTER_AREA);
  small.convertTo(small, CV_32F);
  return small;
}

cv::Mat smoothed(const cv::Mat& image) {
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {}, smooth_px, smooth_px, cv::BORDER_REPLICATE);
  return smooth;
}

double mean_square(const cv::Mat& image) {
  return image.dot(image) / static_cast<double>(image.total());
}

double slopes_square(const cv::Mat& smooth) {
  const cv::Mat x = smooth.colRange(1, smooth.cols) - smooth.colRange(0, smooth.cols - 1);
  const cv::Mat y = smooth.rowRange(1, smooth.rows) - smooth.rowRange(0, smooth.rows - 1);
  return mean_square(x) + mean_square(y);
}

}  // namespace

double apparent_motion(const cv::Mat& before, const cv::Mat& after) {
  CV_Assert(before.type() == after.type() && before.size() == after.size());
  const cv::Mat a = small_gray(before), b = small_gray(after);
  if (a.cols < 2 || a.rows < 2) return 0;
  cv::Mat difference = b - a;
  difference -= cv::mean(difference);
  // Of white noise smoothing leaves 1 / (4 pi s^2) of the variance, 1 / (4 pi s^4) in both slopes.
  const double s2 = smooth_px * smooth_px, noise = std::pow(white_noise_sigma(difference, 1), 2);
  const double changed = mean_square(smoothed(difference)) - noise / (4 * CV_PI * s2);
  const double slopes =
      (slopes_square(smoothed(a)) + slopes_square(smoothed(b)) - noise / (4 * CV_PI * s2 * s2)) / 2;
  // Rounding and the scatter of the estimates: less than this is nothing.
  const double nothing = std::max(1e-6, 0.1 * noise / (4 * CV_PI * s2 * s2));
  if (slopes <= nothing || changed <= 0) return 0;
  // A shift changes a pixel by its length times the slope along it, on average half the square.
  return std::sqrt(2 * changed / slopes) / a.cols;
}

}  // namespace orbitfuse
