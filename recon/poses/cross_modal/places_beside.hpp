// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/cross_modal/orbit_refinement.hpp"

// A view that settled a degree or two beside its place. Edges and patches found again hold it
// there, each a little, since they were looked for about that place; its whole image, compared with
// what the other views measured, is more like them a step aside. Internal to recon/poses.
namespace orbitfuse {

/// Views whose image is no less like what the others measured a degree or two beside their place
/// are bundled anew from there, the others held, and go where temperatures say clearly more for it
/// and form no less. The images are as the settled lens took them. Returns how many went. Errors:
/// the renderer's, cancelled.
Result<int> try_places_beside(const OrbitRefinement& refinement, Fit& alignment);

}  // namespace orbitfuse
