// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/edge_correlation.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>

namespace orbitfuse {
namespace {

constexpr int lanes = 8;
using Lanes = float __attribute__((vector_size(lanes * sizeof(float))));

Lanes loaded(const float* from) {
  Lanes value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// One row of shifts, `blocks` times eight of them side by side: the sums stay in registers over
/// all pixels. Rows of the planes begin at the shift wanted for a pixel at (0, 0).
template <int blocks>
void correlate_row(const std::vector<EdgePixel>& pixels, const float* re, const float* im,
                   std::size_t stride, float* sums) {
  std::array<Lanes, blocks> sum{};
  for (const EdgePixel& p : pixels) {
    const std::size_t at = static_cast<std::size_t>(p.y) * stride + static_cast<std::size_t>(p.x);
#pragma GCC unroll 8
    for (std::size_t b = 0; b < blocks; ++b)
      sum[b] += p.re * loaded(re + at + b * lanes) + p.im * loaded(im + at + b * lanes);
  }
  std::memcpy(sums, sum.data(), sizeof sum);
}

void correlate_row(std::size_t blocks, const std::vector<EdgePixel>& pixels, const float* re,
                   const float* im, std::size_t stride, float* sums) {
  while (blocks > 0) {
    const std::size_t now = std::min<std::size_t>(blocks, 4);
    switch (now) {
      case 1:
        correlate_row<1>(pixels, re, im, stride, sums);
        break;
      case 2:
        correlate_row<2>(pixels, re, im, stride, sums);
        break;
      case 3:
        correlate_row<3>(pixels, re, im, stride, sums);
        break;
      default:
        correlate_row<4>(pixels, re, im, stride, sums);
    }
    blocks -= now, re += now * lanes, im += now * lanes, sums += now * lanes;
  }
}

}  // namespace

std::vector<EdgePixel> edge_pixels(const cv::Mat& edges, float threshold) {
  std::vector<EdgePixel> list;
  for (int y = 0; y < edges.rows; ++y)
    for (int x = 0; x < edges.cols; ++x) {
      const auto& v = edges.at<cv::Vec2f>(y, x);
      const float s = std::hypot(v[0], v[1]);
      if (s > threshold) list.push_back({x, y, v[0], v[1], s});
    }
  return list;
}

FieldPlanes::FieldPlanes(const cv::Mat& field, int reach_px) : reach_px_(reach_px) {
  cv::Mat parts[2];
  cv::split(field, parts);
  // Eight shifts are summed at once, the last of them perhaps for nothing.
  for (auto [part, plane] : {std::pair{parts[0], &re_}, std::pair{parts[1], &im_}})
    cv::copyMakeBorder(part, *plane, reach_px, reach_px, reach_px, reach_px + lanes,
                       cv::BORDER_CONSTANT, cv::Scalar::all(0));
}

cv::Mat1f FieldPlanes::correlation(const std::vector<EdgePixel>& pixels, int cx, int cy,
                                   int reach) const {
  assert(std::max(std::abs(cx), std::abs(cy)) + reach <= reach_px_);
  const int side = 2 * reach + 1;
  const std::size_t blocks = static_cast<std::size_t>(side + lanes - 1) / lanes;
  std::vector<float> sums(blocks * lanes);
  const std::size_t stride = re_.step1();
  cv::Mat1f score(side, side);
  for (int row = 0; row < side; ++row) {
    const int y = reach_px_ + cy - reach + row, x = reach_px_ + cx - reach;
    correlate_row(blocks, pixels, re_[y] + x, im_[y] + x, stride, sums.data());
    std::copy_n(sums.begin(), side, score[row]);
  }
  return score;
}

float FieldPlanes::energy(int x, int y) const {
  const int u = x + reach_px_, v = y + reach_px_;
  if (u < 0 || v < 0 || u >= re_.cols || v >= re_.rows) return 0;
  return re_(v, u) * re_(v, u) + im_(v, u) * im_(v, u);
}

}  // namespace orbitfuse
