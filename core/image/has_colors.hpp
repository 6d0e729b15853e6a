// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace orbitfuse {

/// Of 8 or 16-bit images: a palette's picture or a photograph; grey that was stored as three
/// channels is none, nor is a maker's small coloured mark in it.
bool has_colors(const cv::Mat& image);

}  // namespace orbitfuse
