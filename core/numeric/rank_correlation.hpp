// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace orbitfuse {

/// Where the samples, all finite, stand from below, counted from 0; equal ones share their mean
/// place.
inline std::vector<double> ranks(const std::vector<float>& values) {
  assert(std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); }));
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> result(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double middle = 0.5 * static_cast<double>(begin + end - 1);
    for (; begin < end; ++begin) result[order[begin]] = middle;
  }
  return result;
}

/// Spearman's; NaN where one of both is the same everywhere.
inline double rank_correlation(const std::vector<float>& a, const std::vector<float>& b) {
  assert(a.size() == b.size());
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double mean = 0.5 * (static_cast<double>(x.size()) - 1);
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean) * (x[i] - mean);
    yy += (y[i] - mean) * (y[i] - mean);
    xy += (x[i] - mean) * (y[i] - mean);
  }
  return xy / std::sqrt(xx * yy);
}

}  // namespace orbitfuse
