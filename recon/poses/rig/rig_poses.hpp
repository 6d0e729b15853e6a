// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/rig/rig_estimate.hpp"
#include "recon/poses/rig/rig_pairs.hpp"

namespace orbitfuse {

/// Thermal poses of a rig from the visible ones: one transform and one lens for all pairs. A pair
/// that agrees no better than shuffled ones is kept and contested. Errors: input, quality (fewer
/// than 4 pairs with a posed photo; no support), cancelled.
Result<ThermalPoses> pose_by_rig(const Session& session, const Reconstruction& visible,
                                 const RigPairs& rig, const Progress& progress,
                                 std::vector<LadderStep>& steps);

/// A thermal image whose photo is in doubt is as far off as that.
void doubt_beside(const std::map<std::string, std::string>& doubted_photos, const RigPairs& rig,
                  ThermalPoses& poses);

}  // namespace orbitfuse
