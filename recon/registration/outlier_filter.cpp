// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/outlier_filter.hpp"

#include <algorithm>
#include <cmath>

#include "recon/registration/kd_tree.hpp"

namespace orbitfuse::registration {
namespace {

constexpr std::size_t kNeighbours = 7;  // the point itself and six

std::vector<double> log_neighbour_distances(const Points& points) {
  const KdTree tree(points);
  std::vector<double> logs(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::size_t index[kNeighbours];
    double d2[kNeighbours];
    tree.nearest(points[i], kNeighbours, index, d2);
    logs[i] = 0.5 * std::log(std::max(d2[kNeighbours - 1], 1e-18));
  }
  return logs;
}

struct Split {
  double limit = INFINITY;
  double separation = 0;  ///< of the means in pooled standard deviations
  double log_ratio = 0;   ///< of the mean distances
};

/// Two populations with the least variance inside (Otsu 1979) over exact order statistics.
Split otsu(std::vector<double> sorted) {
  std::sort(sorted.begin(), sorted.end());
  const std::size_t n = sorted.size();
  std::vector<double> sum(n + 1, 0), squares(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    sum[i + 1] = sum[i] + sorted[i];
    squares[i + 1] = squares[i] + sorted[i] * sorted[i];
  }
  const auto mean_variance = [&](std::size_t a, std::size_t b) {
    const double count = static_cast<double>(b - a), mean = (sum[b] - sum[a]) / count;
    return std::pair(mean, std::max(0.0, (squares[b] - squares[a]) / count - mean * mean));
  };
  double least = INFINITY;
  std::size_t at = n / 2;
  for (std::size_t i = n / 10; i < n - n / 50; ++i) {
    const double within = static_cast<double>(i) * mean_variance(0, i).second +
                          static_cast<double>(n - i) * mean_variance(i, n).second;
    if (within < least) {
      least = within;
      at = i;
    }
  }
  const auto [near_mean, near_variance] = mean_variance(0, at);
  const auto [far_mean, far_variance] = mean_variance(at, n);
  Split split;
  split.limit = sorted[at];
  split.log_ratio = far_mean - near_mean;
  split.separation = split.log_ratio / std::sqrt(near_variance + far_variance + 1e-6);
  return split;
}

}  // namespace

Points without_outliers(const Points& points) {
  if (points.size() < 200) return points;
  const std::vector<double> logs = log_neighbour_distances(points);
  const Split split = otsu(logs);
  if (!(split.separation > 2.2 && split.log_ratio > std::log(1.8))) return points;
  Points kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (logs[i] < split.limit) kept.push_back(points[i]);
  }
  return kept;
}

}  // namespace orbitfuse::registration
