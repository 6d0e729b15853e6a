// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace orbitfuse::nerf {

/// How many samples a ray gets: `surface` of them where surfaces are expected, and one per
/// occupied cell, up to `haze`, over everything that is not known to be empty.
struct MarchSettings {
  float near = 0.1f;  ///< normalised units
  int surface = 16;
  int haze = 24;
};

}  // namespace orbitfuse::nerf
