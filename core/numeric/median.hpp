// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <vector>

// Order statistics of samples of any number type, NaN excepted: leave those out before.
namespace orbitfuse {

/// Of a normal distribution: its standard deviation over the median of its absolute values.
inline constexpr double sigma_of_median = 1.4826;

/// The sample of that rank from below; changes their order. O(n).
template <class T>
T ranked(std::vector<T>& values, std::size_t rank) {
  assert(rank < values.size());
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// The sample that `share` (0 to 1) of the others lie below, of rank share * (n - 1) rounded down;
/// 0 of an empty set; changes their order.
template <class T>
T quantile(std::vector<T>& values, double share) {
  assert(share >= 0 && share <= 1);
  if (values.empty()) return 0;
  return ranked(values, static_cast<std::size_t>(share * static_cast<double>(values.size() - 1)));
}

/// The upper of the two middle values of an even number; 0 of an empty set; changes their order.
template <class T>
T median_in(std::vector<T>& values) {
  return values.empty() ? T{0} : ranked(values, values.size() / 2);
}

/// The same of a copy.
inline double median(std::vector<double> values) { return median_in(values); }

}  // namespace orbitfuse
