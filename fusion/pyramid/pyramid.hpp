// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "fusion/pyramid/image_pair.hpp"

// Laplacian pyramid (Burt and Adelson 1983): kernel [1 4 6 4 1]/16, border mirrored without
// repeating the edge. Collapsing what was built gives the image back to float rounding.
namespace orbitfuse::fusion {

struct LaplacianPyramid {
  std::vector<Plane> bands;  ///< finest first
  Plane base;
};

/// Levels an image can be halved while its shorter side keeps at least `min_base_px`.
int pyramid_levels(cv::Size size, int wanted, int min_base_px);

LaplacianPyramid laplacian_pyramid(const Plane& image, int levels);
Plane collapse(const LaplacianPyramid& pyramid);
/// The image and its reductions: levels + 1 planes.
std::vector<Plane> gaussian_pyramid(const Plane& image, int levels);

}  // namespace orbitfuse::fusion
