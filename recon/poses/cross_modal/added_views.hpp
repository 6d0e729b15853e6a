// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/cross_modal/orbit_refinement.hpp"

// Frames recorded between the stations, settled among these. Internal to recon/poses; errors: the
// renderer's, cancelled.
namespace orbitfuse {

/// Every added view, from `first_new` on, adjusted by its patches found again in the sure views
/// before it. One that they don't confirm is looked for once more, among the temperatures of all
/// that are settled then, and goes where more of its patches are confirmed. Fewer than three sure
/// views settle nothing.
Status settle_by_patches(const OrbitRefinement& refinement, std::size_t first_new, Fit& alignment);

}  // namespace orbitfuse
