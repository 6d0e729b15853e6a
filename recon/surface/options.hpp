// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/result.hpp"

namespace orbitfuse {

struct SurfaceOptions {
  /// Voxels along the longest side of the box. Twice as many cost eight times the time where all
  /// is surface; depth of a field is not sure to much less than a pixel of the views anyway.
  int resolution = 320;
  /// Depths farther than this from a voxel don't say how far the surface is. Wide enough for the
  /// depth's error, narrow enough that both sides of a thin wall stay apart.
  double truncation_voxels = 4;
  /// Seen at a flatter angle a depth is mostly error.
  double max_angle_deg = 80;
  /// The least sum of weights (squared cosines of angles) of a voxel that counts as seen.
  double least_weight = 0.25;
  /// Loose pieces smaller than this share of the box's longest side are dropped: floaters of the
  /// field, not parts of the object.
  double least_piece = 0.03;
  /// The ground that the object stands on is left out, where there is one.
  bool without_ground = false;
  /// How far above the ground the object begins, as a share of the box's longest side; more where
  /// the ground is rougher. Lower, and ground stays; higher, and the object loses its feet.
  double ground_clearance = 0.005;
  /// Most triangles; meshoptimizer takes away those that change the form least.
  int triangles = 200'000;

  /// Errors: usage, naming the field.
  Status validate() const;
};

}  // namespace orbitfuse
