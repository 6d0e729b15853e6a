// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/score_map.hpp"

#include <algorithm>
#include <limits>

#include "core/system/parallel.hpp"
#include "fusion/cnn_lpif/conv_row.hpp"

namespace orbitfuse::fusion::cnn {
namespace {

/// Patches a strip works on at once: its feature rows stay in the second-level cache.
constexpr int strip_rows = 8;

/// [row][channel][column], columns padded as conv_row wants them.
struct Features {
  Features(int rows, int channels_, int columns)
      : channels(channels_),
        stride((columns + row_step - 1) / row_step * row_step + 2 * row_step),
        data(static_cast<std::size_t>(rows * channels * stride)) {}
  float* row(int y, int c) { return data.data() + (y * channels + c) * stride; }
  int channels, stride;
  std::vector<float> data;
};

/// Pointers to the k x k neighbourhood of row y in all channels: the order of the parameters.
std::vector<const float*> taps_of(Features& from, int y, int k) {
  std::vector<const float*> taps;
  for (int c = 0; c < from.channels; ++c)
    for (int i = 0; i < k * k; ++i) taps.push_back(from.row(y + i / k, c) + i % k);
  return taps;
}

struct Layer {
  int kernel, weights, bias;  ///< offsets into Parameters; bias < 0: none
  float floor;
};
constexpr Layer layer1{kernel, Layout::conv1, Layout::bias1, 0},
    layer2{kernel, Layout::conv2, Layout::bias2, 0},
    head{side2, Layout::head, -1, -std::numeric_limits<float>::infinity()};

void convolve_row(const Layer& layer, const Parameters& p, Features& from, int y, Features& to,
                  int to_y, int wide, Isa isa) {
  static constexpr float no_bias[1] = {0};
  const auto taps = taps_of(from, y, layer.kernel);
  const ConvRow row{taps.data(),
                    static_cast<int>(taps.size()),
                    p.data() + layer.weights,
                    layer.bias < 0 ? no_bias : p.data() + layer.bias,
                    to.channels,
                    layer.floor,
                    to.row(to_y, 0),
                    to.stride,
                    wide};
  (isa >= Isa::avx512 ? conv_row_avx512 : conv_row_avx2)(row);
}

void max_pool_row(Features& from, Features& to, int to_y, int wide) {
  for (int c = 0; c < to.channels; ++c) {
    const float *a = from.row(0, c), *b = from.row(1, c);
    float* out = to.row(to_y, c);
    for (int x = 0; x < wide; ++x)
      out[x] = std::max(std::max(a[2 * x], a[2 * x + 1]), std::max(b[2 * x], b[2 * x + 1]));
  }
}

/// Scores [top, top + rows) x [left, left + columns) of the map.
void score_tile(const Plane& image, const Parameters& p, const cv::Rect& tile, Plane& scores,
                Isa isa) {
  const int pooled_rows = tile.height + side2 + 1, pooled_columns = tile.width + side2 + 1;
  Features pixels(2 * pooled_rows + 2, 1, 2 * pooled_columns + 2);
  for (int y = 0; y < 2 * pooled_rows + 2; ++y) {
    const float* from = image[2 * tile.y + y] + 2 * tile.x;
    std::transform(from, from + 2 * pooled_columns + 2, pixels.row(y, 0),
                   [](float v) { return v / 255; });
  }
  Features two_rows(2, width1, 2 * pooled_columns), pooled1(pooled_rows, width1, pooled_columns);
  for (int y = 0; y < pooled_rows; ++y) {
    for (int half = 0; half < 2; ++half)
      convolve_row(layer1, p, pixels, 2 * y + half, two_rows, half, 2 * pooled_columns, isa);
    max_pool_row(two_rows, pooled1, y, pooled_columns);
  }
  Features features(pooled_rows - 2, width2, pooled_columns - 2);
  for (int y = 0; y < pooled_rows - 2; ++y)
    convolve_row(layer2, p, pooled1, y, features, y, pooled_columns - 2, isa);
  Features row(1, 1, tile.width);
  for (int y = 0; y < tile.height; ++y) {
    convolve_row(head, p, features, y, row, 0, tile.width, isa);
    std::copy_n(row.row(0, 0), tile.width, scores[tile.y + y] + tile.x);
  }
}

/// Runs of columns of the strip in which any patch is needed. A tile computes side2 + 1 columns
/// more than it answers, so gaps narrower than a few times that are not worth a new run.
std::vector<cv::Range> needed_runs(const cv::Mat1b& needed) {
  constexpr int narrow_gap = 24;
  cv::Mat1b any;
  cv::reduce(needed, any, 0, cv::REDUCE_MAX);
  std::vector<cv::Range> runs;
  for (int x = 0; x < any.cols; ++x) {
    if (!any(0, x)) continue;
    if (!runs.empty() && x - runs.back().end <= narrow_gap)
      runs.back().end = x + 1;
    else
      runs.emplace_back(x, x + 1);
  }
  return runs;
}

}  // namespace

Plane score_map(const Plane& image, const Parameters& parameters, const cv::Mat1b& needed,
                Isa isa) {
  Plane scores = Plane::zeros((image.rows - patch) / 2 + 1, (image.cols - patch) / 2 + 1);
  parallel_blocks(scores.rows, strip_rows, [&](int begin, int end) {
    const auto runs = needed.empty() ? std::vector{cv::Range(0, scores.cols)}
                                     : needed_runs(needed.rowRange(begin, end));
    for (const cv::Range& run : runs)
      score_tile(image, parameters, {run.start, begin, run.size(), end - begin}, scores, isa);
  });
  return scores;
}

}  // namespace orbitfuse::fusion::cnn
