// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "core/geometry/camera.hpp"

namespace orbitfuse {

/// The same view at most `width_px` wide, of the same proportions to a pixel.
inline Camera narrowed_to(const Camera& camera, int width_px) {
  if (camera.width <= width_px) return camera;
  const auto height = std::lround(static_cast<double>(camera.height) * width_px / camera.width);
  return camera.scaled_to(width_px, std::max(1, static_cast<int>(height)));
}

}  // namespace orbitfuse
