// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/score_map.hpp"

#include <algorithm>

#include "core/parallel.hpp"

namespace orbitfuse::fusion::cnn {
namespace {

/// to += weight * from over n samples; the compiler makes it one vector loop.
inline void add_scaled(float* __restrict to, const float* __restrict from, float weight, int n) {
  for (int i = 0; i < n; ++i) to[i] += weight * from[i];
}

/// Patches a strip works on at once: its feature rows stay in the second-level cache.
constexpr int strip_rows = 8;

struct Strip {
  int columns, features;        ///< score columns, feature columns after pooling
  std::vector<float> row[2];    ///< two rows of conv1 for one channel
  std::vector<float> pooled1;   ///< [channel][row][column]
  std::vector<float> conv2;     ///< [channel][row][column]
};

void pooled_rows(const Plane& image, const Parameters& p, int first, int rows, Strip& s) {
  const int wide = 2 * s.features;
  for (int c = 0; c < width1; ++c)
    for (int y = 0; y < rows; ++y) {
      for (int half = 0; half < 2; ++half) {
        float* out = s.row[half].data();
        std::fill_n(out, wide, p[static_cast<std::size_t>(Layout::bias1 + c)]);
        for (int k = 0; k < 9; ++k)
          add_scaled(out, image.ptr<float>(2 * (first + y) + half + k / 3) + k % 3,
                     p[static_cast<std::size_t>(Layout::conv1 + c * 9 + k)] / 255, wide);
      }
      float* out = s.pooled1.data() + (c * rows + y) * s.features;
      const float *a = s.row[0].data(), *b = s.row[1].data();
      for (int x = 0; x < s.features; ++x)
        out[x] = std::max({0.0F, a[2 * x], a[2 * x + 1], b[2 * x], b[2 * x + 1]});
    }
}

void conv2_rows(const Parameters& p, int rows, Strip& s) {
  const int wide = s.features - 2, from_rows = rows + 2;
  for (int c = 0; c < width2; ++c)
    for (int y = 0; y < rows; ++y) {
      float* out = s.conv2.data() + (c * rows + y) * wide;
      std::fill_n(out, wide, p[static_cast<std::size_t>(Layout::bias2 + c)]);
      for (int d = 0; d < width1; ++d)
        for (int k = 0; k < 9; ++k)
          add_scaled(out, s.pooled1.data() + (d * from_rows + y + k / 3) * s.features + k % 3,
                     p[static_cast<std::size_t>(Layout::conv2 + (c * width1 + d) * 9 + k)], wide);
      for (int x = 0; x < wide; ++x) out[x] = std::max(0.0F, out[x]);
    }
}

void head_rows(const Parameters& p, int first, int rows, const Strip& s, Plane& scores) {
  const int wide = s.features - 2, from_rows = rows + side2 - 1;
  for (int y = 0; y < rows; ++y) {
    float* out = scores[first + y];
    for (int c = 0; c < width2; ++c)
      for (int k = 0; k < side2 * side2; ++k)
        add_scaled(out, s.conv2.data() + (c * from_rows + y + k / side2) * wide + k % side2,
                   p[static_cast<std::size_t>(Layout::head + c * side2 * side2 + k)], scores.cols);
  }
}

}  // namespace

Plane score_map(const Plane& image, const Parameters& parameters, const cv::Mat1b& needed) {
  Plane scores = Plane::zeros((image.rows - patch) / 2 + 1, (image.cols - patch) / 2 + 1);
  parallel_blocks(scores.rows, strip_rows, [&](int begin, int end) {
    if (!needed.empty() && cv::countNonZero(needed.rowRange(begin, end)) == 0) return;
    const int rows = end - begin;
    Strip s{scores.cols, scores.cols + side2 + 1, {}, {}, {}};
    const auto features = static_cast<std::size_t>(s.features);
    for (auto& row : s.row) row.resize(2 * features);
    s.pooled1.resize(features * static_cast<std::size_t>(width1 * (rows + side2 + 1)));
    s.conv2.resize(features * static_cast<std::size_t>(width2 * (rows + side2 - 1)));
    pooled_rows(image, parameters, begin, rows + side2 + 1, s);
    conv2_rows(parameters, rows + side2 - 1, s);
    head_rows(parameters, begin, rows, s, scores);
  });
  return scores;
}

}  // namespace orbitfuse::fusion::cnn
