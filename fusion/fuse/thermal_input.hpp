// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/image/palette.hpp"
#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse {

/// A thermal image as fusion sees it.
struct ThermalGray {
  fusion::Plane gray;  ///< 0..255
  cv::Mat1b valid;     ///< 255 where the image holds something; empty = everywhere
};

/// CV_8U or CV_16U: the samples over their full range, 3 channels by their luma. CV_32FC1: kelvin
/// (or any other unit), NaN and infinite = invalid; `span` goes to 0..255, values beyond are cut.
/// Without a span the image's own: its 0.5 and 99.5 percentiles, at least 0.5 wide. A locked span
/// keeps equal temperatures equally bright in all images. Errors: another type, no valid sample
/// (input); a span that is not finite and rising (usage).
Result<ThermalGray> thermal_gray(const cv::Mat& thermal,
                                 const std::optional<TemperatureSpan>& span);

/// CV_8U or CV_16U, 1 or 3 channels, to floats in 0..255 of as many; `which` names it in errors.
Result<cv::Mat> floats_of(const cv::Mat& image, const char* which);
fusion::Plane luma(const cv::Mat& floats);

}  // namespace orbitfuse
