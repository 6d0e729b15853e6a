// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/view/finished_run.hpp"

namespace orbitfuse::inspection {

/// A finding on the plan.
struct PlanMark {
  int number = 0;
  Eigen::Vector3d position;
  std::string view;  ///< the frame that its pictures are from; empty: none
};

/// The run from above as HTML with SVG: its surface, the cameras of both orbits with where they
/// look, doubtful ones crossed, and the findings by number, each joined to the camera of its
/// pictures; where they lie close together, they have a drawing of their own. World positions
/// become a plan by leaving out the orbit's up direction; no north, no scale: the run knows
/// neither.
std::string plan_svg(const view::FinishedRun& run, const std::vector<PlanMark>& marks);

}  // namespace orbitfuse::inspection
