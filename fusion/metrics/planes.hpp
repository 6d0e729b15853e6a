// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::metrics {

/// One channel as CV_64FC1, 0..255, continuous.
using Plane = cv::Mat1d;

/// The channels of an image; error naming it when it is empty, of another type or not finite.
Result<std::vector<Plane>> planes_of(const cv::Mat& image, const std::string& name);

/// Channels of several images, gray ones repeated to the largest count; error on different sizes.
Result<std::vector<std::vector<Plane>>> matched_planes(const std::vector<cv::Mat>& images,
                                                       const std::vector<std::string>& names,
                                                       int min_side);

/// Stretched to 0..255 and rounded; a constant plane becomes 0 (VIFB leaves it as it is, but then
/// only zero is defined).
Plane stretched(const Plane& plane);

}  // namespace orbitfuse::metrics
