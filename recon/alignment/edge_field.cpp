// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/edge_field.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "core/image/samples.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {

/// The values below which a smaller and a larger share of all lie.
std::pair<float, float> percentiles(const cv::Mat& values, double smaller, double larger) {
  std::vector<float> v(values.begin<float>(), values.end<float>());
  const float high = quantile(v, larger);
  return {quantile(v, smaller), high};
}

/// Invalid samples take the image's median: no gradient of their own where they are few.
cv::Mat filled(const cv::Mat& values) {
  cv::Mat copy = values.clone();
  if (std::all_of(copy.begin<float>(), copy.end<float>(), [](float v) { return std::isfinite(v); }))
    return copy;
  std::vector<float> good;
  append_finite(copy, good);
  const float middle = median_in(good);
  for (float& v : cv::Mat_<float>(copy))
    if (!std::isfinite(v)) v = middle;
  return copy;
}

}  // namespace

cv::Mat orientation_field(const cv::Mat& values, double sigma_px) {
  cv::Mat image = filled(values), dx, dy;
  // A saturated or empty region (sky) far below the scene would set the scale of everything.
  const auto [low, high] = percentiles(image, 0.02, 0.98);
  cv::max(image, low, image);
  cv::min(image, high, image);
  cv::GaussianBlur(image, image, {}, sigma_px);
  cv::Sobel(image, dx, CV_32F, 1, 0, 1, 0.5);
  cv::Sobel(image, dy, CV_32F, 0, 1, 1, 0.5);
  cv::Mat magnitude;
  cv::magnitude(dx, dy, magnitude);
  cv::Mat field(image.size(), CV_32FC2, cv::Scalar::all(0));
  const auto [noise, strong] = percentiles(magnitude, 0.5, 0.99);
  const float unit = std::max(3.0f * noise, 0.02f * strong);
  if (!(strong > 0) || !(unit > 0)) return field;
  const float full = std::log1p(strong / unit);
  for (int y = 0; y < field.rows; ++y)
    for (int x = 0; x < field.cols; ++x) {
      const float gx = dx.at<float>(y, x), gy = dy.at<float>(y, x), m = magnitude.at<float>(y, x);
      if (!(m > 0)) continue;
      const float strength = std::min(1.0f, std::log1p(m / unit) / full) / (m * m);
      field.at<cv::Vec2f>(y, x) = {strength * (gx * gx - gy * gy), strength * 2 * gx * gy};
    }
  return field;
}

cv::Mat reduced_to(const cv::Mat& image, const Camera& camera) {
  cv::Mat reduced;
  cv::resize(image, reduced, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  return reduced;
}

cv::Mat edges_at(const cv::Mat& image, const Camera& camera) {
  return orientation_field(reduced_to(image, camera), 1.0);
}

cv::Mat cell_field(const cv::Mat& field, int columns, int rows) {
  cv::Mat cells;
  cv::resize(field, cells, {columns, rows}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(cells, cells, {}, 0.8);
  return cells;
}

}  // namespace orbitfuse
