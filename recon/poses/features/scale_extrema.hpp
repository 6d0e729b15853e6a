// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/poses/features/scale_space.hpp"

namespace orbitfuse {

/// A peak of the difference of Gaussians, in samples of its octave.
struct ScaleExtremum {
  double x = 0, y = 0, sigma = 0;
};

/// Samples of one scale, 0 to scales_per_octave - 1, above or below all 26 neighbours in position
/// and scale, placed between samples by a parabola (Brown and Lowe, BMVC 2002), without those of
/// less contrast than `peak_threshold` and those on edges. Row by row.
std::vector<ScaleExtremum> scale_extrema(const Octave& octave, int scale, double peak_threshold,
                                         double edge_threshold);

}  // namespace orbitfuse
