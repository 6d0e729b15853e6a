// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/progress.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/sfm/feature_graph.hpp"

namespace orbitfuse {

struct PlacedElsewhereOptions {
  /// Of the orbit's radius: what is nearer is no other place.
  double least_shift = 0.01;
  /// By how many standard deviations of a count more of its matches must agree there than here.
  double more_sigmas = 3;
  /// Of the orbit's radius: where as many (but for one standard deviation) agree this far aside,
  /// they hold it in neither place. Right views lie up to 0.026 aside by noise, a wrong one 0.063
  /// (`five_drums`); on scenes left out 0.013 and 0.355 (`forklift`, seed 7), 0.027 and 0.090
  /// (`solar`, seed 62).
  double open_shift = 0.04;
};

/// Views that the other views' points place elsewhere. What was found along a view's own epipolar
/// lines agrees with it wherever it stands, so its residuals are small in a wrong place too; its
/// exact matches with points that the others alone hold are not of its making. Views that these
/// leave between two places are named as well (docs/notes/poses_visible.md). A view of whose
/// matches fewer than twenty show such points is not named. Errors: cancelled.
Result<std::vector<DoubtfulView>> placed_elsewhere(const FeatureGraph& graph,
                                                   const Reconstruction& model,
                                                   const Progress& progress,
                                                   const PlacedElsewhereOptions& options = {});

}  // namespace orbitfuse
