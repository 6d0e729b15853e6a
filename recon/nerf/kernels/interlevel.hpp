// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

// Proposal sampling along one ray (Mip-NeRF 360, sections 3 and 4). Templates, so that tests run
// them in double.
namespace orbitfuse::nerf {

/// Distances spaced evenly up to 1 and evenly in disparity beyond, as in nerfacto: [0, inf) to [0,
/// 1).
template <class T>
T spaced_of(T t) {
  return t < 1 ? t / 2 : 1 - 1 / (2 * t);
}
template <class T>
T distance_of(T spaced) {
  return spaced < T(0.5) ? 2 * spaced : 1 / (2 - 2 * spaced);
}

/// `count` + 1 edges that split the histogram (`bins` weights between bins + 1 `edges`) into parts
/// of about equal mass. `padding` is added to each weight, so that nothing is never looked at;
/// `jitter` in [0, 1) moves all edges alike.
template <class T>
void resample(int bins, const T* edges, const T* weights, T padding, T jitter, int count, T* out) {
  T total = 0;
  for (int i = 0; i < bins; ++i) total += weights[i] + padding;
  const int ends = count + 1;
  if (!(total > 0)) {  // nothing is known, or not a number: look everywhere
    for (int i = 0; i < ends; ++i)
      out[i] = edges[0] + static_cast<T>(i) / static_cast<T>(count) * (edges[bins] - edges[0]);
    return;
  }
  T before = 0;
  int bin = 0;
  for (int i = 0; i < ends; ++i) {
    const T wanted = (static_cast<T>(i) + jitter) / static_cast<T>(ends) * total;
    while (bin + 1 < bins && before + weights[bin] + padding < wanted) {
      before += weights[bin] + padding;
      ++bin;
    }
    const T mass = weights[bin] + padding;
    const T part = mass > 0 ? std::clamp((wanted - before) / mass, T(0), T(1)) : T(0);
    out[i] = edges[bin] + part * (edges[bin + 1] - edges[bin]);
  }
}

/// Mip-NeRF 360, eq. 13: sum_i max(0, w_i - bound_i)^2 / w_i, where bound_i is the mass of the
/// proposal's bins that fine interval i ([low_i, high_i], ascending) overlaps. Adds scale *
/// gradient to dproposal (`bins` values) and returns the loss. `slope`: scratch of bins + 1 values.
template <class T>
T interlevel(int fine, const T* low, const T* high, const T* w, int bins, const T* edges,
             const T* proposal, T scale, T* dproposal, std::vector<T>& slope) {
  slope.assign(static_cast<std::size_t>(bins) + 1, 0);
  T loss = 0;
  int first = 0;
  for (int i = 0; i < fine; ++i) {
    while (first + 1 < bins && edges[first + 1] <= low[i]) ++first;
    T bound = 0;
    int last = first;
    for (; last < bins && (last == first || edges[last] < high[i]); ++last) bound += proposal[last];
    const T missing = w[i] - bound;
    if (!(missing > 0)) continue;
    const T weight = w[i] + T(1e-7);
    loss += missing * missing / weight;
    slope[static_cast<std::size_t>(first)] -= 2 * missing / weight;
    slope[static_cast<std::size_t>(last)] += 2 * missing / weight;
  }
  T sum = 0;
  for (int j = 0; j < bins; ++j) {
    sum += slope[static_cast<std::size_t>(j)];
    dproposal[j] += scale * sum;
  }
  return loss;
}

}  // namespace orbitfuse::nerf
