// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/sensor.hpp"

#include "core/temperature.hpp"
#include "drivers/synthetic/noise.hpp"

namespace orbitfuse::synthetic {

cv::Mat spoil_thermal(const cv::Mat& kelvin, const ThermalDefects& defects, std::uint64_t seed,
                      std::uint64_t index) {
  cv::Mat out(kelvin.size(), CV_16UC1);
  Random noise(mix(seed, 1000 + index)), pattern(mix(seed, 1)), columns(mix(seed, 2)),
      drift(mix(seed, 500 + index));
  const double frame_offset_k = defects.drift_k * drift.gaussian();
  std::vector<double> column_k(static_cast<std::size_t>(kelvin.cols));
  for (double& c : column_k) c = 0.5 * defects.fixed_pattern_k * columns.gaussian();
  const double cx = 0.5 * kelvin.cols, cy = 0.5 * kelvin.rows, corner2 = cx * cx + cy * cy;
  for (int y = 0; y < kelvin.rows; ++y) {
    for (int x = 0; x < kelvin.cols; ++x) {
      const double dx = x + 0.5 - cx, dy = y + 0.5 - cy;
      const double t = static_cast<double>(kelvin.at<float>(y, x)) + frame_offset_k +
                       defects.noise_k * noise.gaussian() +
                       defects.fixed_pattern_k * pattern.gaussian() +
                       column_k[static_cast<std::size_t>(x)] -
                       defects.vignetting_k * (dx * dx + dy * dy) / corner2;
      out.at<std::uint16_t>(y, x) = centikelvin_from_kelvin(static_cast<float>(t));
    }
  }
  return out;
}

void spoil_visible(cv::Mat& bgr, double noise_levels, std::uint64_t seed, std::uint64_t index) {
  Random noise(mix(seed, 2000 + index));
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      for (int c = 0; c < 3; ++c) {
        unsigned char& level = bgr.at<cv::Vec3b>(y, x)[c];
        level = cv::saturate_cast<unsigned char>(level + noise_levels * noise.gaussian());
      }
    }
  }
}

cv::Mat ideal_centikelvin(const cv::Mat& kelvin) {
  cv::Mat out(kelvin.size(), CV_16UC1);
  for (int y = 0; y < kelvin.rows; ++y) {
    for (int x = 0; x < kelvin.cols; ++x) {
      out.at<std::uint16_t>(y, x) = centikelvin_from_kelvin(kelvin.at<float>(y, x));
    }
  }
  return out;
}

}  // namespace orbitfuse::synthetic
