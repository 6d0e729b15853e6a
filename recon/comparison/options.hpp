// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/result.hpp"

namespace orbitfuse::comparison {

/// Lengths are shares of the diagonal of AFTER's surface, so that units do not matter.
struct ComparisonOptions {
  /// Two surfaces are of one object where this share of each, its ground apart, lies near the other
  /// and faces the same way (SurfaceRegistration::overlap): .37 of two box-shaped machines in a
  /// yard each, .82 of one machine in two runs.
  double least_overlap = 0.5;
  double overlap_distance = 0.01;  ///< what near means there
  /// How well AFTER's photos fit renders of BEFORE from the same cameras (similarity_support):
  /// tells objects of one outline apart, and is chosen low enough for another sun.
  double least_support = 0.2;
  /// A surface has moved that lies farther from the other than this many times both depths' noise,
  double change_sigmas = 3;
  double least_change = 0.006;  ///< and at least this far: a mesh is no finer.
  /// What lies so near to a region that came is part of it: its foot is nearer to what it stands on
  /// than least_change, and its rim shares pixels with it.
  double foot_reach = 0.009;
  int least_views = 2;            ///< that must see through a place where the surface is gone
  double max_angle_deg = 75;      ///< of a view to the surface: a flatter one says little of depth
  double least_difference_k = 1;  ///< smaller ones are no finding
  double least_region_area = 3e-4;  ///< of the surface's area: smaller regions are single vertices

  /// Errors: usage, naming the field.
  Status validate() const;
};

}  // namespace orbitfuse::comparison
