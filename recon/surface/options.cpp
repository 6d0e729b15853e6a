// SPDX-License-Identifier: BSD-3-Clause
#include "recon/surface/options.hpp"

#include "core/option_range.hpp"

namespace orbitfuse {

Status SurfaceOptions::validate() const {
  const OptionCheck check("surface");
  // 1024 voxels a side: the table of blocks alone is then 8 MB; voxels are kept near surfaces only.
  ORBITFUSE_TRY(check("resolution", resolution, from_to(8, 1024)));
  ORBITFUSE_TRY(check("truncation_voxels", truncation_voxels, from_to(2, 8)));
  ORBITFUSE_TRY(check("max_angle_deg", max_angle_deg, from_to(1, 89)));
  ORBITFUSE_TRY(check("least_weight", least_weight, above(0)));
  ORBITFUSE_TRY(check("least_piece", least_piece, from_to(0, 1)));
  ORBITFUSE_TRY(check("ground_clearance", ground_clearance, from_to(0, 0.5)));
  return check("triangles", triangles, from_to(4, 20'000'000));
}

}  // namespace orbitfuse
