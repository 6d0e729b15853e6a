// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/learned_views.hpp"

#include "app/stages/artifacts.hpp"
#include "core/geometry/seen_by_some.hpp"

namespace orbitfuse::stages {
namespace {

/// Of all posed photos, those that must be left: of a session in doubt as a whole nothing better is
/// known than all of it.
constexpr double least_share = 0.75;

}  // namespace

Result<LearnedViews> learned_views(const pipeline::StageContext& context, Modality modality) {
  const std::filesystem::path folder = context.of("poses_" + std::string(name(modality)));
  ORBITFUSE_ASSIGN(Reconstruction all, load_poses(folder, modality));
  std::vector<char> kept(all.views.size(), 1);
  LearnedViews learned;
  if (modality == Modality::visible) {
    ORBITFUSE_ASSIGN(const auto doubts, load_doubts(folder));
    for (std::size_t v = 0; v < kept.size(); ++v) {
      if (!doubts.contains(all.views[v].name)) continue;
      kept[v] = 0;
      learned.left_out.push_back(all.views[v].name);
    }
  }
  const double most = (1 - least_share) * static_cast<double>(kept.size());
  if (static_cast<double>(learned.left_out.size()) > most) {
    learned.left_out.clear();
    kept.assign(kept.size(), 1);
  }
  int next = 0;
  for (const char keep : kept) learned.place.push_back(keep != 0 ? next++ : -1);
  learned.model = learned.left_out.empty() ? std::move(all) : part_of(all, kept);
  return learned;
}

std::vector<DepthMap> of_learned(std::vector<DepthMap> maps, const LearnedViews& learned) {
  for (DepthMap& map : maps) {
    const auto view = static_cast<std::size_t>(map.view);
    map.view = map.view >= 0 && view < learned.place.size() ? learned.place[view] : -1;
  }
  std::erase_if(maps, [](const DepthMap& map) { return map.view < 0; });
  return maps;
}

}  // namespace orbitfuse::stages
