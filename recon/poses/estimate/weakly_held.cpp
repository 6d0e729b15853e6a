// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/weakly_held.hpp"

#include <fmt/format.h>

#include "recon/poses/index.hpp"

namespace orbitfuse {

std::vector<DoubtfulView> weakly_held(const Reconstruction& model, int fewest) {
  if (model.views.size() < 3) return {};
  std::vector<int> common(model.views.size(), 0);
  for (const SparsePoint& point : model.points)
    if (point.track.size() > 2)
      for (const Observation& o : point.track) ++common[at(o.view)];
  std::vector<DoubtfulView> views;
  for (std::size_t v = 0; v < common.size(); ++v)
    if (common[v] < fewest)
      views.push_back({model.views[v].name, DoubtReason::few_common_points,
                       fmt::format("{} of its points are seen by two other views, {} hold a view; "
                                   "take one between it and the next",
                                   common[v], fewest)});
  return views;
}

}  // namespace orbitfuse
