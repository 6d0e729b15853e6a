// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "core/session/session.hpp"

namespace orbitfuse {

/// An edge of contrast C that was blurred by a Gaussian of sigma s has the peak slope
/// C / (sqrt(2 pi) s); contrast and peak give s (an edge's width as in Marziliano et al., ICIP
/// 2002). Slopes are taken through a Gaussian whose width is then subtracted; its scale grows until
/// edges stand clear of the noise, which the finest diagonal detail tells (Donoho 1995). A median
/// over the strongest edges of each of four directions; shading and soft shadows are left out.
/// `gray`: CV_32FC1, finite. Constant images, noise alone and images under 16 px have no edges.
EdgeBlur measure_edge_blur(const cv::Mat& gray);

}  // namespace orbitfuse
