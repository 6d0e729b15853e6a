// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
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

/// The model of the views that are `kept` (one flag a view); points that fewer than two of them see
/// go.
inline Reconstruction part_of(const Reconstruction& all, const std::vector<char>& kept) {
  Reconstruction part;
  part.modality = all.modality;
  std::vector<int> place(all.views.size(), -1);
  for (std::size_t i = 0; i < all.views.size(); ++i) {
    if (kept[i] == 0) continue;
    place[i] = static_cast<int>(part.views.size());
    part.views.push_back(all.views[i]);
  }
  for (const SparsePoint& point : all.points) {
    SparsePoint seen = seen_by_some(point, place);
    if (seen.track.size() > 1) part.points.push_back(std::move(seen));
  }
  return part;
}

}  // namespace orbitfuse
