// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "fusion/metrics/measures.hpp"

namespace orbitfuse::metrics {
namespace {

constexpr int patch_px = 15;       // side of the window that a level is the median of
constexpr double least_edge = 32;  // gray levels: what counts as an edge of levels
constexpr double unseen = 8;       // gray levels: a level this near to a source's is that source's

/// Median of the patch round each pixel: textures go, edges stay where they are.
cv::Mat1b levels(const Plane& plane) {
  cv::Mat1b bytes, median;
  plane.convertTo(bytes, CV_8U);
  cv::medianBlur(bytes, median, patch_px);
  return median;
}

/// 255 within a patch's reach of an edge.
cv::Mat1b near_edge(const cv::Mat1b& level) {
  const cv::Mat window = cv::Mat::ones(2 * patch_px + 1, 2 * patch_px + 1, CV_8U);
  cv::Mat range;
  cv::morphologyEx(level, range, cv::MORPH_GRADIENT, window);
  return range > least_edge;
}

}  // namespace

Halo::Halo(const Plane& visible, const Plane& thermal)
    : visible_(levels(visible)), thermal_(levels(thermal)) {
  near_edge_ = near_edge(visible_) | near_edge(thermal_);
}

double Halo::of(const Plane& fused) const {
  const cv::Mat1b f = levels(fused);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < f.rows; ++y)
    for (int x = 0; x < f.cols; ++x) {
      if (!near_edge_(y, x)) continue;
      const int distance =
          std::min(std::abs(f(y, x) - visible_(y, x)), std::abs(f(y, x) - thermal_(y, x)));
      sum += std::max(0.0, distance - unseen);
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

}  // namespace orbitfuse::metrics
