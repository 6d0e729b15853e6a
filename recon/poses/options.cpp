// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include "core/option_range.hpp"

namespace orbitfuse {

Status PoseOptions::validate() const {
  const OptionCheck check("poses");
  if (colmap.empty())
    return fail(ErrorKind::usage, "poses.colmap", "empty", "give COLMAP's command, e.g. colmap");
  ORBITFUSE_TRY(check("max_image_side_px", max_image_side_px, from_to(100, 20000)));
  ORBITFUSE_TRY(check("max_features", max_features, from_to(100, 100000)));
  ORBITFUSE_TRY(check("min_posed_ratio", min_posed_ratio, from_to(0.0, 1.0)));
  ORBITFUSE_TRY(check("max_reprojection_rms_px", max_reprojection_rms_px, from_to(0.1, 100.0)));
  return check("max_station_residual", max_station_residual, from_to(0.01, 10.0));
}

}  // namespace orbitfuse
