// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/result.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// A frame as floats (CV_32FC1): visible luma 0..255, thermal kelvin (or grey); NaN = invalid.
/// Errors: input (unreadable, or not of the size that the session says).
Result<cv::Mat> read_luminance(const Session& session, const FrameRecord& frame);

/// Thermal values whose hottest parts don't drown the rest: beyond eight interquartile ranges above
/// the median they rise by their logarithm only (a flame of 900 C among walls of 10 to 30 C would
/// otherwise be the only edge). Order is kept; images without such values are returned as they are.
cv::Mat without_glare(const cv::Mat& values);

}  // namespace orbitfuse
