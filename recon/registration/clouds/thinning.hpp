// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/registration/similarity.hpp"

namespace orbitfuse::registration {

/// One point, the mean, per occupied voxel; in order of first appearance.
Points thinned(const Points& points, double voxel);

/// Thinned with the finest voxel that leaves at most `wanted` points; exact duplicates go always.
/// Points lie within a few units of the origin.
Points thinned_to(const Points& points, int wanted);

/// About `wanted` indices, evenly strided: points in order of appearance of a shuffled cloud.
std::vector<int> strided_subset(std::size_t count, int wanted);

}  // namespace orbitfuse::registration
