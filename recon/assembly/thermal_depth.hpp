// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/progress.hpp"
#include "recon/nerf/dataset.hpp"

namespace orbitfuse {

struct ThermalDepth {
  double known = 0;                    ///< share of the pixels whose depth another view confirms
  std::optional<std::string> problem;  ///< why there is none
};

/// Adds depth to a thermal dataset that no visible field lends its geometry: matched between its
/// own training views at a small width, where noise is averaged out (docs/notes/nerf.md).
/// Views that train() drops or measures (`holdout_every`) take no part. Depth is a help that
/// training can do without: what prevents it is told in ThermalDepth::problem. Errors: cancelled.
Result<ThermalDepth> add_thermal_depth(nerf::Dataset& data, int width_px, int holdout_every,
                                       std::uint64_t seed, const Progress& progress);

}  // namespace orbitfuse
