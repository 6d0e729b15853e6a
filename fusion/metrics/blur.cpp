// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/metrics/blur.hpp"

#include <algorithm>
#include <cmath>

#include "core/system/parallel.hpp"
#include "fusion/metrics/lanes.hpp"

namespace orbitfuse::metrics {
namespace {

constexpr int unroll = 4, chunk = lanes * unroll;

const Lanes& at(const double* p) { return *reinterpret_cast<const Lanes*>(p); }

/// out[x] = half[0] centre[x] + sum_k half[k] (before(k)[x] + after(k)[x]), x over whole chunks.
template <class Before, class After>
void filter_row(const double* centre, const Before& before, const After& after,
                const std::vector<double>& half, int width, double* out) {
  for (int x = 0; x < width; x += chunk) {
    Lanes sum[unroll];
    for (int u = 0; u < unroll; ++u) sum[u] = half[0] * at(centre + x + u * lanes);
    for (int k = 1; k < static_cast<int>(half.size()); ++k) {
      const double *a = before(k) + x, *b = after(k) + x, w = half[static_cast<std::size_t>(k)];
      for (int u = 0; u < unroll; ++u) sum[u] += w * (at(a + u * lanes) + at(b + u * lanes));
    }
    for (int u = 0; u < unroll; ++u) *reinterpret_cast<Lanes*>(out + x + u * lanes) = sum[u];
  }
}

}  // namespace

std::vector<double> gaussian_half(double sigma, int reach, double scale) {
  std::vector<double> half;
  for (int i = 0; i <= reach; ++i) half.push_back(scale * std::exp(-i * i / (2 * sigma * sigma)));
  return half;
}

Plane blurred(const Plane& f, const std::vector<double>& half) {
  const int reach = static_cast<int>(half.size()) - 1,
            padded = (f.cols + chunk - 1) / chunk * chunk;
  // Whole chunks of columns and `reach` rows of zeros on either side: no border cases.
  Plane source = Plane::zeros(f.rows + 2 * reach, padded);
  f.copyTo(source(cv::Rect(0, reach, f.cols, f.rows)));
  Plane out(f.size());
  parallel_blocks(f.rows, 16, [&](int begin, int end) {
    std::vector<double> column(static_cast<std::size_t>(padded + 2 * reach), 0.0),
        row(static_cast<std::size_t>(padded));
    double* middle = column.data() + reach;
    for (int y = begin; y < end; ++y) {
      filter_row(
          source[y + reach], [&](int k) { return source[y + reach - k]; },
          [&](int k) { return source[y + reach + k]; }, half, padded, middle);
      filter_row(
          middle, [&](int k) { return middle - k; }, [&](int k) { return middle + k; }, half,
          padded, row.data());
      std::copy_n(row.data(), f.cols, out[y]);
    }
  });
  return out;
}

}  // namespace orbitfuse::metrics
