// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/session/session.hpp"

namespace orbitfuse {

/// Sharpness: variance of the 3x3 Laplacian over the variance of the image, at no more than 640
/// pixels across, so that it does not depend on contrast or resolution (Pech-Pacheco et al.,
/// ICPR 2000, normalised). A constant image has sharpness 0.
/// Without edge_blur, which costs more than all else: measure_edges() is for frames that are
/// judged. `image`: CV_8UC3, CV_8UC1 or CV_16UC1 counts of temperature; 0 is no sample in the last.
FrameQuality measure_quality(const cv::Mat& image, double kelvin_per_count = 0.01);

/// Of the same images; see measure_edge_blur().
EdgeBlur measure_edges(const cv::Mat& image);

}  // namespace orbitfuse
