// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/progress.hpp"
#include "recon/nerf/dataset.hpp"

namespace orbitfuse::stages {

/// Adds depth of thermal views that lend each other none through a visible field: matched at a small width,
/// where neither noise nor the blur of heat is left (docs/benchmarks/nerf.md). Every `holdout_every`-th view
/// (0: none) takes no part. Returns the share of pixels whose depth another view confirms; 0 without parallax.
Result<double> add_thermal_depth(nerf::Dataset& data, int width_px, int holdout_every, std::uint64_t seed,
                                 const Progress& progress);

}  // namespace orbitfuse::stages
