// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/result.hpp"

namespace orbitfuse::fusion {

/// One channel, CV_32FC1, 0..255 (values beyond are allowed, e.g. after overshoot).
using Plane = cv::Mat1f;

inline constexpr int min_side_px = 16;

/// Input error unless both are CV_32FC1 of one size, at least 16 x 16, every sample finite.
Status check_pair(const cv::Mat& visible, const cv::Mat& thermal);

/// Share of samples in which the two differ by more than `tolerance`.
double differing_share(const Plane& visible, const Plane& thermal, float tolerance);

}  // namespace orbitfuse::fusion
