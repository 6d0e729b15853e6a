// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace orbitfuse {

/// How far the picture has moved between two frames of one camera, in shares of the image's width:
/// the shift of its slopes that makes as large a difference as there is, beyond the noise of both.
/// People who walk by and a scene that changes move it too; a change of brightness does not. An
/// upper bound for small shifts; large ones are at least the size of what is seen. Images without
/// slopes tell nothing: 0. Equal sizes and types; CV_8UC3, CV_8UC1 or CV_16UC1.
double apparent_motion(const cv::Mat& before, const cv::Mat& after);

}  // namespace orbitfuse
