// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/result.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// Frames as floats: visible luma 0..255, thermal kelvin (or grey); NaN = invalid.
Result<cv::Mat> read_luminance(const Session& session, const FrameRecord& frame);

}  // namespace orbitfuse
