// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "core/result.hpp"

namespace orbitfuse::depth {

struct DepthOptions {
  /// Width of the depth maps (4:3; other formats get as many pixels). Geometry is smoother than
  /// texture: 400 pixels cost twice the time, and fields and thermal poses are no better for it
  /// (docs/notes/planner.md).
  int width_px = 280;
  int neighbours = 5;  ///< views each view is matched with
  /// Of these, the best so many count: the others may be occluded. Orbits of 30 degrees rarely show
  /// a surface well in more.
  int best_neighbours = 2;
  double max_angle_deg = 75;  ///< between viewing directions; beyond it patches don't match
  double min_angle_deg = 3;   ///< below it there is no parallax
  int coarse_iterations = 5;  ///< at half width, from random planes and sparse points
  int fine_iterations = 2;    ///< at full width, from the coarse planes
  double max_cost = 0.5;      ///< 1 - NCC above which a match is none
  double agreement = 0.012;   ///< relative depth difference below which two views agree
  double agreement_px = 2.0;  ///< and distance after projecting there and back
  int min_agreeing = 1;       ///< views that must agree with a depth
  /// Pixels of the open ground that nothing confirms get the depth of the plane under the object,
  /// those of the sky an infinite one (ground/extend_ground.hpp): far out the lowest views alone
  /// see either, and fields would stand them up as curtains and fog.
  bool ground = true;
  /// How far from the centre it goes at most, in mean distances of the cameras: fields hold matter
  /// to 16 of them.
  double ground_far = 12;
  std::uint64_t seed = 1;

  Status validate() const;
};

}  // namespace orbitfuse::depth
