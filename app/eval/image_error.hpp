// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace orbitfuse::eval {

/// 10 log10(peak^2 / mean squared error) over all samples; infinite for equal images.
double psnr_db(const cv::Mat& a, const cv::Mat& b, double peak);

struct ThermalViewError {
  double mae_k = 0;    ///< over pixels where both are finite and the truth is scene
  double covered = 0;  ///< share of the scene's pixels that have a rendered temperature
  double psnr_db = 0;  ///< over the truth's own span
};

/// Pixels of `truth_k` at or below `scene_above_k` are not scene.
ThermalViewError thermal_view_error(const cv::Mat& rendered_k, const cv::Mat& truth_k,
                                    double scene_above_k);

/// Gray levels and true temperatures of the same pixels, of all views.
struct LevelPairs {
  std::vector<float> level, kelvin;
  std::size_t scene = 0;  ///< pixels of the scene, whether they have a level or not

  /// As thermal_view_error() takes pixels.
  void add(const cv::Mat& levels, const cv::Mat& truth_k, double scene_above_k);
};

struct LevelError {
  double rank_correlation = 0;  ///< Spearman's: 1 where warmer always is brighter
  /// How far off temperatures are where each level stands for the one it usually has, mean.
  double mae_k = 0;
  double covered = 0;  ///< share of the scene's pixels that have a level
};

/// NaN where there are fewer than 100 pairs, or one level or temperature alone.
LevelError level_error(const LevelPairs& pairs);

}  // namespace orbitfuse::eval
