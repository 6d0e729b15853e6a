// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/best/compact_heat.hpp"

#include <opencv2/imgproc.hpp>

namespace orbitfuse::fusion {

Plane compact_heat(const Plane& thermal, float least) {
  constexpr int reduction = 4, side = 15;
  if (least < 0) return Plane::zeros(thermal.size());
  Plane reduced, above, heat;
  const cv::Size size((thermal.cols + reduction - 1) / reduction,
                      (thermal.rows + reduction - 1) / reduction);
  cv::resize(thermal, reduced, size, 0, 0, cv::INTER_AREA);
  cv::morphologyEx(reduced, above, cv::MORPH_TOPHAT, cv::Mat::ones(side, side, CV_8U));
  above = cv::min(cv::max((above - least) / (2 * least + 1e-3F), 0.0F), 1.0F);
  cv::resize(above, heat, thermal.size(), 0, 0, cv::INTER_LINEAR);
  return heat;
}

}  // namespace orbitfuse::fusion
