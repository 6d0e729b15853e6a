// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "recon/nerf/dataset.hpp"

namespace orbitfuse::nerf {

/// What a thermal lens and its housing take from (or add to) the sides of every image alike. An
/// uncooled camera is set right for the middle; towards the corners vignetting and the lens' own
/// heat are left over, tenths of a kelvin to some kelvin (narcissus, shading).
struct Shading {
  double falloff_k = 0;  ///< as shading_image() takes it
  double sigma_k =
      std::numeric_limits<double>::infinity();  ///< of it: views left out in turn (jackknife)
  double alone = 0;  ///< share of r^2's variation that neither drift nor angle can stand for
  int points = 0;    ///< places of the maps that two views or more see

  /// Otherwise images are better left as they are.
  bool told() const;
};

/// From what the views that train see of the same points: T(view, point) = a(point) + drift(view) +
/// falloff * r^2(pixel) + b (1 - cos) + c (1 - cos)^2 of the angle to the surface's normal, since
/// surfaces emit less the flatter they are seen; by robust least squares (weights fall with the
/// square of the residual). Points come from `depth`, which holds maps of views that train; those
/// on an edge of temperature, where errors of poses decide what is seen, are left out. What a whole
/// image has too little or too much, its middle included, no view can tell.
Shading estimate_shading(const Dataset& dataset, const std::vector<DepthMap>& depth);

}  // namespace orbitfuse::nerf
