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
  if (modality != Modality::visible) return LearnedViews{std::move(all), {}};
  ORBITFUSE_ASSIGN(const auto doubts, load_doubts(folder));
  std::vector<char> kept;
  std::vector<std::string> left_out;
  for (const PosedView& view : all.views) {
    kept.push_back(doubts.contains(view.name) ? 0 : 1);
    if (kept.back() == 0) left_out.push_back(view.name);
  }
  const double most = (1 - least_share) * static_cast<double>(all.views.size());
  if (left_out.empty() || static_cast<double>(left_out.size()) > most)
    return LearnedViews{std::move(all), {}};
  return LearnedViews{part_of(all, kept), std::move(left_out)};
}

}  // namespace orbitfuse::stages
