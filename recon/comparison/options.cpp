// SPDX-License-Identifier: BSD-3-Clause
#include "recon/comparison/options.hpp"

#include "core/option_range.hpp"

namespace orbitfuse::comparison {

Status ComparisonOptions::validate() const {
  const OptionCheck check("compare");
  ORBITFUSE_TRY(check("least_overlap", least_overlap, from_to(0, 1)));
  ORBITFUSE_TRY(check("overlap_distance", overlap_distance, above_up_to(0, 1)));
  ORBITFUSE_TRY(check("least_support", least_support, from_to(0, 1)));
  ORBITFUSE_TRY(check("change_sigmas", change_sigmas, above_up_to(0, 100)));
  ORBITFUSE_TRY(check("least_change", least_change, above_up_to(0, 1)));
  ORBITFUSE_TRY(check("foot_reach", foot_reach, from_to(0, 0.1)));
  ORBITFUSE_TRY(check("least_views", least_views, from_to(1, 1000)));
  ORBITFUSE_TRY(check("max_angle_deg", max_angle_deg, between(0, 90)));
  ORBITFUSE_TRY(check("least_difference_k", least_difference_k, above_up_to(0, 1000)));
  return check("least_region_area", least_region_area, from_to(0, 1));
}

}  // namespace orbitfuse::comparison
