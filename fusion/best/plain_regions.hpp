// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/pyramid/image_pair.hpp"

namespace orbitfuse::fusion {

struct Ties {
  float strength;  ///< between neighbours, against a sample's own value
  float edge;      ///< gray levels, of both sources together: a step that parts two regions
  int sweeps;      ///< of the solver; values reach at most sqrt(strength / own) samples
};

/// Values that agree within plain regions of both sources: the minimum x of
///   sum_i own_i (x_i - value_i)^2 + strength sum_ij exp(-(step_ij / edge)^2) (x_i - x_j)^2
/// over neighbours i, j (weighted least squares; Farbman et al. 2008), by successive
/// over-relaxation. Planes of one size; own > 0.
Plane within_regions(const Plane& value, const Plane& own, const Plane& visible,
                     const Plane& thermal, const Ties& ties);

}  // namespace orbitfuse::fusion
