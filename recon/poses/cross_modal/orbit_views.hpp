// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/transform.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// Thermal images, and where on their orbit each was meant to be taken.
struct OrbitViews {
  std::vector<cv::Mat> images;
  std::vector<Station> stations;
  Similarity3d canonical_from_world;  ///< z up, origin at the orbit's centre
  bool clockwise = false;
  bool assumed = false;  ///< nobody told the stations: an even walk in the order of capture
};

}  // namespace orbitfuse
