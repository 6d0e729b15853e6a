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
      if (!(t > scene_above_k) || !std::isfinite(t) || !std::isfinite(l)) continue;
      level.push_back(l);
      kelvin.push_back(t);
    }
}

LevelError level_error(const LevelPairs& pairs) {
  constexpr std::size_t groups = 256;
  const double nothing = std::nan("");
  if (pairs.level.empty()) return {nothing, nothing};
  const double correlation = rank_correlation(pairs.level, pairs.kelvin);
  const auto [darkest, brightest] = std::minmax_element(pairs.level.begin(), pairs.level.end());
  if (!(*darkest < *brightest)) return {nothing, nothing};
  std::vector<std::size_t> order(pairs.level.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return pairs.level[a] < pairs.level[b]; });
  double off = 0;
  for (std::size_t g = 0; g < groups; ++g) {
    std::vector<double> kelvin;
    for (std::size_t i = g * order.size() / groups; i < (g + 1) * order.size() / groups; ++i)
      kelvin.push_back(static_cast<double>(pairs.kelvin[order[i]]));
    const double usual = median(kelvin);
    for (const double k : kelvin) off += std::abs(k - usual);
  }
  return {correlation, off / static_cast<double>(order.size())};
}

}  // namespace orbitfuse::eval
