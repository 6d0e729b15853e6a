// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "drivers/synthetic/orbit.hpp"

namespace orbitfuse::synthetic {

/// CV_16UC1 centikelvin as an uncooled camera would deliver frame `index` of the ideal image.
cv::Mat spoil_thermal(const cv::Mat& kelvin, const ThermalDefects& defects, std::uint64_t seed,
                      std::uint64_t index);
/// Adds sensor noise to an 8-bit image, in place.
void spoil_visible(cv::Mat& bgr, double noise_levels, std::uint64_t seed, std::uint64_t index);
/// CV_16UC1 centikelvin without defects.
cv::Mat ideal_centikelvin(const cv::Mat& kelvin);

}  // namespace orbitfuse::synthetic
