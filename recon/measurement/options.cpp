// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/options.hpp"

#include "core/option_range.hpp"

namespace orbitfuse::measurement {

Status MeasurementOptions::validate() const {
  const OptionCheck check("measure");
  ORBITFUSE_TRY(check("depth_width_px", depth_width_px, from_to(16, 4096)));
  ORBITFUSE_TRY(check("depth_tolerance", depth_tolerance, between(0, 1)));
  ORBITFUSE_TRY(check("max_angle_deg", max_angle_deg, above_up_to(0, 89)));
  ORBITFUSE_TRY(check("doubtful_weight", doubtful_weight, from_to(0, 1)));
  ORBITFUSE_TRY(check("pose_sigma_px", pose_sigma_px, from_to(0, 100)));
  ORBITFUSE_TRY(check("noise_sigma_k", noise_sigma_k, above_up_to(0, 100)));
  ORBITFUSE_TRY(check("common_sigma_k", common_sigma_k, from_to(0, 100)));
  ORBITFUSE_TRY(check("statistical_share", statistical_share, from_to(0, 100)));
  ORBITFUSE_TRY(check("gradient_share", gradient_share, from_to(0, 100)));
  ORBITFUSE_TRY(check("disagreement_share", disagreement_share, from_to(0, 100)));
  ORBITFUSE_TRY(check("variation_share", variation_share, from_to(0, 100)));
  return check("coverage_factor", coverage_factor, above_up_to(0, 100));
}

}  // namespace orbitfuse::measurement
