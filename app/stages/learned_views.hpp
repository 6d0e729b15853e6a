// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"
#include "core/geometry/reconstruction.hpp"

namespace orbitfuse::stages {

/// Of a modality's posed views, those that its field learns from, and depth and thermal poses with
/// it. A photo in the wrong place spoils more of a field than its absence does
/// (docs/notes/nerf.md#doubtful-photos): where the others are most of them, photos in doubt are
/// left out, whatever they are doubted for (measured: single photos, poses of the program's own).
/// Thermal views are right more often where they are in doubt, and all taken.
struct LearnedViews {
  Reconstruction model;
  std::vector<std::string> left_out;
  std::vector<int> place;  ///< of each posed view in the model; -1: left out
};
/// Errors: input (the poses' folder is cut or of another version).
Result<LearnedViews> learned_views(const pipeline::StageContext& context, Modality modality);

/// Depth maps of posed views as those of the model's; others go.
std::vector<DepthMap> of_learned(std::vector<DepthMap> maps, const LearnedViews& learned);

}  // namespace orbitfuse::stages
