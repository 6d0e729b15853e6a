// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/result.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// A frame as floats (CV_32FC1): visible luma 0..255, thermal kelvin (or grey); NaN = invalid.
/// Errors: input (unreadable, or not of the size that the session says).
Result<cv::Mat> read_luminance(const Session& session, const FrameRecord& frame);

/// Thermal values mostly by rank: each becomes (in about 0..1) the share of the image that is
/// colder, so that the temperatures that most pixels have show what differs between them, and a
/// flame or a cold sky doesn't drown the rest. No steeper than that noise stays below 2 % of the
/// range, which a plain wall's else would fill; and to three tenths by the value itself between the
/// 2 and 98 percentiles, so that a step between two plain surfaces stays one. Order is kept; NaN
/// stays NaN; a constant image becomes zeros. (Histogram equalisation with a plateau, as thermal
/// cameras make their pictures by.)
cv::Mat equalised(const cv::Mat& values);

}  // namespace orbitfuse
