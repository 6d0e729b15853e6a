// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/imgproc.hpp>

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

/// A quarter of each side, rounded up: where levels and small things are looked for.
inline Plane quartered(const Plane& image) {
  Plane result;
  cv::resize(image, result, {(image.cols + 3) / 4, (image.rows + 3) / 4}, 0, 0, cv::INTER_AREA);
  return result;
}

}  // namespace orbitfuse::fusion
