// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::nerf {

/// ViewRays as plain numbers, for a device.
struct RayNumbers {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double world_from_cam[3][3] = {};
  double origin[3] = {};  ///< normalised scene space
  /// Normalised coordinates (x, y) of every `lattice_px` pixels, where the lens distorts; 0
  /// columns: it doesn't.
  int lattice_columns = 0, lattice_rows = 0;
};
inline constexpr int lattice_px = 8;

}  // namespace orbitfuse::nerf
