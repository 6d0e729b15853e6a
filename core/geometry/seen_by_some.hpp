// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/reconstruction.hpp"

namespace orbitfuse {

/// The point as some of the views know it: `place` says where each stands among those, -1 if not.
inline SparsePoint seen_by_some(const SparsePoint& point, const std::vector<int>& place) {
  SparsePoint kept = point;
  kept.track.clear();
  for (Observation seen : point.track) {
    seen.view = place[static_cast<std::size_t>(seen.view)];
    if (seen.view >= 0) kept.track.push_back(seen);
  }
  return kept;
}

}  // namespace orbitfuse
