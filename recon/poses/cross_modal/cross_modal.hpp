// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/cross_modal/placed_views.hpp"
#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

/// Thermal views posed in the visible reconstruction, without features and without SfM. Lines of
/// the visible scene propose places of the whole orbit (orbit_search.hpp), renders of its trained
/// field choose among them and among several starts of each view (orbit_selection.hpp) and align
/// the views to a fraction of a pixel (view_recovery.hpp); temperatures that other views measured
/// contradict or confirm (temperature_consistency.hpp), and every view gets a verdict
/// (view_verdicts.hpp). Tracking frames follow, started between the stations they were recorded
/// between. Views that nothing supports are dropped and named, views that something speaks against
/// are kept as doubtful. Errors: input, quality (no orbit, too few lines, too few views that are
/// sure), cancelled.
Result<ThermalPoses> localise_in_visible(const Session& session, const VisibleScene& visible,
                                         const std::vector<const FrameRecord*>& frames,
                                         const PoseOptions& options, const Progress& progress,
                                         std::vector<LadderStep>& steps);

/// Sorts placed views into kept, doubtful and dropped ones, with the gates and warnings that
/// follow.
void take_verdicts(const PlacedViews& placed, ModalityPoses& poses);

}  // namespace orbitfuse
