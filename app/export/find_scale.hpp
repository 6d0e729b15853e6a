// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "app/stages/metric_scale.hpp"
#include "app/view/finished_run.hpp"
#include "core/geometry/pose_error.hpp"
#include "recon/measurement/request.hpp"

// Where a run's metres come from. Images alone don't say: one thing of known length has to be in
// them.
namespace orbitfuse::exporting {

/// "1.20m", "35cm", "350mm" as metres. Usage error without a unit, or for what is no length.
Result<double> metres_of(const std::string& option, const std::string& words);

/// Two places (pixels of recorded views, or points of the run's world) that are `metres` apart. The
/// uncertainty is that of a pixel in pointing and of the depth where they were pointed at; that of
/// the tape is the user's. Errors: usage (a view that the run has not, a pixel outside or where
/// nothing is, places that are one), the renderer's.
Result<stages::MetricScale> scale_of_distance(const view::FinishedRun& run,
                                              const measurement::Place& from,
                                              const measurement::Place& to, double metres,
                                              const Progress& progress);

/// Cameras whose places are known in metres, truth = metres: the similarity between both sets. Its
/// uncertainty is what the fit leaves, or what `place_error_m` (of a place along each axis, one
/// standard deviation) makes of it if that is more. Errors: input (fewer than three, on a line, or
/// so far off that they are not the same cameras).
Result<stages::MetricScale> scale_of_cameras(std::vector<PosePair> pairs, const std::string& source,
                                             double place_error_m = 0);

/// By the poses that came with the session, whose unit the user vouches to be metres. Errors: input
/// (no session, none of its frames has one), usage (the run took them as they are, so that no fit
/// shows how exact they are, and nobody said).
Result<stages::MetricScale> scale_of_known_poses(const view::FinishedRun& run,
                                                 std::optional<double> place_error_m);

}  // namespace orbitfuse::exporting
