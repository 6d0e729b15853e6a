// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "core/progress.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/known/blocks.hpp"
#include "recon/poses/known/session_poses.hpp"
#include "recon/poses/known/slips.hpp"
#include "recon/poses/sfm/feature_graph.hpp"

// Poses that came with the photos, held against what the photos show: nothing else of a run would
// say that they belong to other images, are inverted, or have a focal length of another lens.
namespace orbitfuse {

/// What matches between photos say of given poses. Distances are of missed_side_px.
struct PhotoJudgement {
  std::size_t matches = 0;
  int checked = 0;               ///< views with enough matches to be judged
  double share = 1;              ///< of the matches, held within close_px
  double median_px = 0;          ///< by which true matches miss
  bool contradicted = false;     ///< the poses as a whole
  std::optional<Slip> slip;      ///< that would explain it
  std::optional<Blocks> blocks;  ///< likewise
  /// What speaks against its pose; the first are so wrong that they would spoil others.
  NamedViews wrong, doubtful;
};

/// `given`: the views of the graph's frames, in their order. Under a hundred matches nothing is
/// judged (`checked` 0). Errors: cancelled.
Result<PhotoJudgement> judge_by_photos(const FeatureGraph& graph, const Reconstruction& given,
                                       const Progress& progress);

/// Matches photos of neighbouring views and judges `poses` by them: views whose poses are wrong are
/// dropped, others doubted, both by name; where no photo can be matched, or nothing matches, a skip
/// says so. Errors: quality (the poses as a whole contradict the photos), cancelled.
Status check_by_photos(const Session& session, const PoseOptions& options,
                       const std::filesystem::path& workdir, const Progress& progress,
                       ModalityPoses& poses);

}  // namespace orbitfuse
