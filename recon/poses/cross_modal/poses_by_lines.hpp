// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/cross_modal/line_alignment.hpp"
#include "recon/poses/cross_modal/placed_views.hpp"

namespace orbitfuse {

/// Without a renderer the scene's lines have the last word: every hypothesis aligned with them, the
/// best one judged. Errors: quality (no start angle better than the next), cancelled.
Result<PlacedViews> place_by_lines(const OrbitWork& work,
                                   const std::vector<OrbitHypothesis>& hypotheses,
                                   const Similarity3d& canonical_from_visible,
                                   const Progress& progress);

}  // namespace orbitfuse
