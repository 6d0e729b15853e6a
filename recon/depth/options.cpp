// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/options.hpp"

#include "core/option_range.hpp"

namespace orbitfuse::depth {

Status DepthOptions::validate() const {
  const OptionCheck check("depth");
  ORBITFUSE_TRY(check("width_px", width_px, from_to(32, 8192)));
  ORBITFUSE_TRY(check("neighbours", neighbours, from_to(1, 16)));
  ORBITFUSE_TRY(check("best_neighbours", best_neighbours, from_to(1, neighbours)));
  ORBITFUSE_TRY(check("max_angle_deg", max_angle_deg, above_up_to(0, 90)));
  ORBITFUSE_TRY(check("min_angle_deg", min_angle_deg,
                      {.low = 0, .high = max_angle_deg, .high_included = false}));
  ORBITFUSE_TRY(check("coarse_iterations", coarse_iterations, from_to(0, 100)));
  ORBITFUSE_TRY(check("fine_iterations", fine_iterations, from_to(0, 100)));
  ORBITFUSE_TRY(check("max_cost", max_cost, between(0, 1)));
  ORBITFUSE_TRY(check("agreement", agreement, between(0, 1)));
  ORBITFUSE_TRY(check("agreement_px", agreement_px, above(0)));
  ORBITFUSE_TRY(check("ground_far", ground_far, from_to(1, 1000)));
  return check("min_agreeing", min_agreeing, from_to(1, neighbours));
}

}  // namespace orbitfuse::depth
