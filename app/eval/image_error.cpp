// SPDX-License-Identifier: BSD-3-Clause
#include "app/eval/image_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/numeric/median.hpp"
#include "core/numeric/rank_correlation.hpp"

namespace orbitfuse::eval {

double psnr_db(const cv::Mat& a, const cv::Mat& b, double peak) {
  CV_Assert(a.size() == b.size() && a.type() == b.type());
  const double squared = std::pow(cv::norm(a, b, cv::NORM_L2), 2);
  const double mse =
      squared / static_cast<double>(a.total() * static_cast<std::size_t>(a.channels()));
  return mse > 0 ? 10 * std::log10(peak * peak / mse) : std::numeric_limits<double>::infinity();
}

ThermalViewError thermal_view_error(const cv::Mat& rendered_k, const cv::Mat& truth_k,
                                    double scene_above_k) {
  CV_Assert(rendered_k.size() == truth_k.size());
  double absolute = 0, squared = 0, low = 1e9, high = -1e9;
  long scene = 0, covered = 0;
  for (int y = 0; y < truth_k.rows; ++y)
    for (int x = 0; x < truth_k.cols; ++x) {
      const double t = truth_k.at<float>(y, x), r = rendered_k.at<float>(y, x);
      if (!(t > scene_above_k)) continue;
      ++scene;
      low = std::min(low, t);
      high = std::max(high, t);
      if (!std::isfinite(r)) continue;
      ++covered;
      absolute += std::abs(r - t);
      squared += (r - t) * (r - t);
    }
  ThermalViewError error;
  if (covered == 0) return {std::nan(""), 0, std::nan("")};
  const auto n = static_cast<double>(covered);
  error.mae_k = absolute / n;
  error.covered = n / static_cast<double>(scene);
  error.psnr_db = squared > 0 ? 10 * std::log10((high - low) * (high - low) * n / squared)
                              : std::numeric_limits<double>::infinity();
  return error;
}

void LevelPairs::add(const cv::Mat& levels, const cv::Mat& truth_k, double scene_above_k) {
  CV_Assert(levels.size() == truth_k.size());
  for (int y = 0; y < truth_k.rows; ++y)
    for (int x = 0; x < truth_k.cols; ++x) {
      const float t = truth_k.at<float>(y, x), l = levels.at<float>(y, x);
      if (!(t > scene_above_k) || !std::isfinite(t)) continue;
      ++scene;
      if (!std::isfinite(l)) continue;
      level.push_back(l);
      kelvin.push_back(t);
    }
}

LevelError level_error(const LevelPairs& pairs) {
  // A median of few says what these are, not what their level means.
  constexpr std::size_t most_groups = 256, least_in_group = 100;
  const double nothing = std::nan("");
  LevelError error{nothing, nothing, 0};
  if (pairs.scene == 0) return error;
  const std::size_t count = pairs.level.size();
  error.covered = static_cast<double>(count) / static_cast<double>(pairs.scene);
  const std::size_t groups = std::min(most_groups, count / least_in_group);
  if (groups == 0) return error;
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return pairs.level[a] < pairs.level[b]; });
  double off = 0;
  for (std::size_t g = 1, begin = 0; begin < count; ++g) {
    std::size_t end = std::max(begin + 1, g * count / groups);
    while (end < count && pairs.level[order[end]] == pairs.level[order[end - 1]]) ++end;
    std::vector<double> kelvin;
    for (; begin < end; ++begin) kelvin.push_back(static_cast<double>(pairs.kelvin[order[begin]]));
    const double usual = median(kelvin);
    for (const double k : kelvin) off += std::abs(k - usual);
  }
  error.rank_correlation = rank_correlation(pairs.level, pairs.kelvin);
  if (std::isfinite(error.rank_correlation)) error.mae_k = off / static_cast<double>(count);
  return error;
}

}  // namespace orbitfuse::eval
