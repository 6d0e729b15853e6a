// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <utility>

#include "capture/guide/coverage.hpp"

namespace orbitfuse {

/// How sharp a frame is for what it shows. The measure depends on the scene: on one thermal orbit
/// sharp views differ by a factor of five. So a frame is compared with the best one from nearly the
/// same place, and only loosely (two fifths of its weight) with the camera's best anywhere.
class SharpnessReference {
 public:
  /// 0..1; takes the frame into account. Without position only the loose comparison is left.
  double relative(double sharpness, const std::optional<OrbitPosition>& position);

 private:
  double best_ = 0;
  std::map<std::pair<int, int>, double> best_near_;  ///< by cells of azimuth and elevation
};

}  // namespace orbitfuse
