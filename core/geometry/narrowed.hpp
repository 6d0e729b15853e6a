// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "core/geometry/camera.hpp"

namespace orbitfuse {

/// The same view `width_px` wide, of the same proportions to a pixel, 2 or more high: what is made
/// of its neighbouring rows stays defined.
inline Camera at_width(const Camera& camera, int width_px) {
  const auto height =
      std::lround(static_cast<double>(camera.height) * width_px / std::max(1, camera.width));
  return camera.scaled_to(width_px, std::max(2, static_cast<int>(height)));
}

/// The same, of a view that is wider; otherwise the view itself.
inline Camera narrowed_to(const Camera& camera, int width_px) {
  return camera.width <= width_px ? camera : at_width(camera, width_px);
}

}  // namespace orbitfuse
