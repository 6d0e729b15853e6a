// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "app/stages/metric_scale.hpp"
#include "app/view/finished_run.hpp"
#include "capture/mat/mat_design.hpp"

namespace orbitfuse::exporting {

/// The middle of a tag as one view sees it.
struct TagRay {
  Eigen::Vector2d on_mat_m;         ///< which tag: where the design has its middle
  Eigen::Vector3d from, direction;  ///< the camera's centre; of length 1; in the run's world
};

/// The middles of the tags where the rays of several views meet, laid over where they are on the
/// mat. What is known of a place far off is its direction: the poses say how far it is, and a focal
/// length that is a little off says nothing. Errors: input (fewer than three tags seen by two
/// views from different sides, tags that don't lie as on the mat).
Result<stages::MetricScale> scale_of_tags(const std::vector<TagRay>& rays, const MatDesign& design);

/// By the printed mat in the visible frames. Errors: usage (design), input (no session, no visible
/// views, too few of them show the mat), cancelled.
Result<stages::MetricScale> scale_of_mat(const view::FinishedRun& run, const MatDesign& design,
                                         const Progress& progress);

}  // namespace orbitfuse::exporting
