// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

/// Thermal views posed in the visible reconstruction, without features and without SfM: lines of
/// the visible scene are looked for in the thermal images, over all places of the orbit at once
/// (orbit_search.hpp), then aligned to a fraction of a pixel (edge_alignment.hpp). Tracking frames
/// follow, started between the stations they were recorded between.
/// A view that doesn't earn its pose is dropped and named.
/// Errors: input, quality (no orbit, too few lines, an undecided start angle), cancelled.
Result<ThermalPoses> localise_in_visible(const Session& session, const VisibleScene& visible,
                                         const std::vector<const FrameRecord*>& frames,
                                         const PoseOptions& options, const Progress& progress,
                                         std::vector<LadderStep>& steps);

/// Says in `why` and in the gate "views_against_temperatures" which views are kept against the
/// other views' temperatures: the contested ones, and `undecided` that nobody was left to judge.
void tell_contradicted(int undecided, ModalityPoses& poses, std::string& why);

}  // namespace orbitfuse
