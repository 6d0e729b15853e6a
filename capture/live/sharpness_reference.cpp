// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/sharpness_reference.hpp"

#include <algorithm>
#include <cmath>

namespace orbitfuse {
namespace {

constexpr int cells = 24;  // of azimuth; with the neighbours a frame is compared over 45 degrees
constexpr double elevation_cell_deg = 15, weight_of_best_anywhere = 0.4;

}  // namespace

double SharpnessReference::relative(double sharpness,
                                    const std::optional<OrbitPosition>& position) {
  if (!(sharpness > 0)) return 0;
  best_ = std::max(best_, sharpness);
  double reference = weight_of_best_anywhere * best_;
  if (position && std::isfinite(position->azimuth_deg) && std::isfinite(position->elevation_deg)) {
    const double turns = position->azimuth_deg / 360;
    const int column = static_cast<int>((turns - std::floor(turns)) * cells) % cells;
    const int row = static_cast<int>(std::floor(position->elevation_deg / elevation_cell_deg));
    double& own = best_near_[{column, row}];
    own = std::max(own, sharpness);
    for (const int side : {cells - 1, 0, 1}) {
      const auto near = best_near_.find({(column + side) % cells, row});
      if (near != best_near_.end()) reference = std::max(reference, near->second);
    }
  }
  return std::min(1.0, sharpness / reference);
}

}  // namespace orbitfuse
