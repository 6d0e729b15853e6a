// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/features/scale_space.hpp"

#include <immintrin.h>
#include <algorithm>
#include <cmath>

namespace orbitfuse {
namespace {

constexpr int blur_lanes = 8;
constexpr double camera_blur = 0.5;  ///< of an image as it comes, in its pixels (Lowe, 3.3)
const double level_step = std::pow(2.0, 1.0 / scales_per_octave);

/// Rows end in room for two vectors, so that kernels need no tails, nor when they look one sample
/// ahead.
cv::Mat padded_image(int width, int height) {
  const int stride = (width + 2 * blur_lanes - 1) / blur_lanes * blur_lanes;
  cv::Mat image(height, stride, CV_32F);
  image.colRange(width, stride).setTo(0);
  return image.colRange(0, width);
}

/// Its centre and one side.
std::vector<float> half_gaussian(double sigma) {
  std::vector<double> weights;
  double sum = 0;
  for (int k = 0; k <= static_cast<int>(std::ceil(4 * sigma)); ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (sigma * sigma)));
    sum += (k == 0 ? 1 : 2) * weights.back();
  }
  std::vector<float> kernel;
  for (const double weight : weights) kernel.push_back(static_cast<float>(weight / sum));
  return kernel;
}

/// out[x] = kernel[0] centre[x] + sum of kernel[k] (before_k[x] + after_k[x]); four vectors at a
/// time hide the latency of the sums.
template <class Before, class After>
void convolve(const std::vector<float>& kernel, const float* centre, const Before& before,
              const After& after, int width, float* out) {
  const int sides = static_cast<int>(kernel.size());
  int x = 0;
  const auto blocks = [&]<int vectors>() {
    for (; x + (vectors - 1) * blur_lanes < width; x += vectors * blur_lanes) {
      __m256 sum[vectors];
      const __m256 first = _mm256_set1_ps(kernel[0]);
      for (int v = 0; v < vectors; ++v)
        sum[v] = _mm256_mul_ps(first, _mm256_loadu_ps(centre + x + v * blur_lanes));
      for (int k = 1; k < sides; ++k) {
        const __m256 weight = _mm256_set1_ps(kernel[static_cast<std::size_t>(k)]);
        const float *a = before(k) + x, *b = after(k) + x;
        for (int v = 0; v < vectors; ++v)
          sum[v] = _mm256_fmadd_ps(weight,
                                   _mm256_add_ps(_mm256_loadu_ps(a + v * blur_lanes),
                                                 _mm256_loadu_ps(b + v * blur_lanes)),
                                   sum[v]);
      }
      for (int v = 0; v < vectors; ++v) _mm256_storeu_ps(out + x + v * blur_lanes, sum[v]);
    }
  };
  blocks.template operator()<4>();
  blocks.template operator()<1>();
}

/// Twice the size: samples and their means; the last go on.
cv::Mat doubled(const cv::Mat& image) {
  cv::Mat wide = padded_image(2 * image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y) {
    const float* from = image.ptr<float>(y);
    float* to = wide.ptr<float>(y);
    for (int x = 0; x < image.cols; ++x) {
      to[2 * x] = from[x];
      to[2 * x + 1] = 0.5f * (from[x] + from[std::min(x + 1, image.cols - 1)]);
    }
  }
  cv::Mat large = padded_image(wide.cols, 2 * wide.rows);
  for (int y = 0; y < wide.rows; ++y) {
    const float *from = wide.ptr<float>(y), *next = wide.ptr<float>(std::min(y + 1, wide.rows - 1));
    float *same = large.ptr<float>(2 * y), *mean = large.ptr<float>(2 * y + 1);
    for (int x = 0; x < wide.cols; ++x) {
      same[x] = from[x];
      mean[x] = 0.5f * (from[x] + next[x]);
    }
  }
  return large;
}

/// Levels above the first: each adds what is missing to its own blur.
void add_levels(Octave& octave) {
  const double added = std::sqrt(1 - 1 / (level_step * level_step));
  for (int scale = 0; scale <= scales_per_octave + 1; ++scale)
    octave.levels.push_back(blurred(octave.levels.back(), added * Octave::sigma(scale)));
}

}  // namespace

double Octave::sigma(double scale) {
  return 1.6 * level_step * std::pow(2.0, scale / scales_per_octave);
}

cv::Mat blurred(const cv::Mat& image, double sigma) {
  const std::vector<float> kernel = half_gaussian(sigma);
  const int reach = static_cast<int>(kernel.size()) - 1, last = image.rows - 1;
  cv::Mat source = image;
  if (image.step1() <
      static_cast<std::size_t>((image.cols + blur_lanes - 1) / blur_lanes * blur_lanes)) {
    source = padded_image(image.cols, image.rows);
    image.copyTo(source);
  }
  cv::Mat result = padded_image(image.cols, image.rows);
  // One row down the columns, then along itself while it is in the cache.
  std::vector<float> row(static_cast<std::size_t>(image.cols + 2 * reach + 4 * blur_lanes));
  float* const centre = row.data() + reach;
  for (int y = 0; y < image.rows; ++y) {
    const auto above = [&](int k) { return source.ptr<float>(std::max(y - k, 0)); };
    const auto below = [&](int k) { return source.ptr<float>(std::min(y + k, last)); };
    convolve(kernel, source.ptr<float>(y), above, below, image.cols, centre);
    std::fill(row.data(), centre, centre[0]);
    std::fill(centre + image.cols, row.data() + row.size(), centre[image.cols - 1]);
    const auto left = [&](int k) { return centre - k; };
    const auto right = [&](int k) { return centre + k; };
    convolve(kernel, centre, left, right, image.cols, result.ptr<float>(y));
  }
  return result;
}

Octave first_octave(const cv::Mat& gray) {
  cv::Mat image;
  gray.convertTo(image, CV_32F, 1 / 255.0);
  const double wanted = Octave::sigma(-1), present = 2 * camera_blur;
  Octave octave;
  octave.spacing_px = 0.5;
  octave.levels.push_back(blurred(doubled(image), std::sqrt(wanted * wanted - present * present)));
  add_levels(octave);
  return octave;
}

std::optional<Octave> next_octave(const Octave& octave) {
  const int width = octave.width() / 2, height = octave.height() / 2;
  if (width == 0 || height == 0) return {};
  // Twice as blurred as the first level is: the next octave's first as it stands.
  const cv::Mat& from = octave.level(scales_per_octave - 1);
  cv::Mat half = padded_image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) half.at<float>(y, x) = from.at<float>(2 * y, 2 * x);
  Octave next;
  next.spacing_px = 2 * octave.spacing_px;
  next.levels.push_back(half);
  add_levels(next);
  return next;
}

}  // namespace orbitfuse
