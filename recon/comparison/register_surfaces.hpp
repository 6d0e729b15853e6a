// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/geometry/triangle_mesh.hpp"
#include "core/progress.hpp"
#include "recon/comparison/options.hpp"
#include "recon/registration/register.hpp"

namespace orbitfuse::comparison {

/// How the world of a later run lies in that of an earlier one.
struct SurfaceRegistration {
  Similarity3d before_from_after;
  /// Robust sigma of the distance between both surfaces where they hold still, BEFORE's unit.
  double residual = 0;
  /// Share of each surface's vertices within overlap_distance of the other that face the same way,
  /// the lesser of both; without those that face as most do, the ground's.
  double overlap = 0;
  /// One standard deviation of before_from_after.scale, as a share of it: from what the places that
  /// hold still contradict each other by. Errors that whole walls share count once, not once a
  /// vertex.
  double scale_sigma = 0;
  RegistrationReport clouds;  ///< the search before the refinement
};

/// A start by register_clouds (`view_score` decides where geometry leaves several placements), then
/// point-to-plane from both sides with Tukey's weights, so that what moved does not pull. Meshes
/// with normals, visible geometry. Errors: usage (options), register_clouds' (also where too little
/// is left to refine on), quality ("the registration": surfaces that do not hold together, or in
/// several ways).
Result<SurfaceRegistration> register_surfaces(const TriangleMesh& after, const TriangleMesh& before,
                                              const ViewScore& view_score,
                                              const ComparisonOptions& options,
                                              const Progress& progress);

/// The refinement alone, from a start within a few degrees and percent. Errors: input (fewer than
/// 50 vertices that face each other, or such that leave a direction open).
Result<SurfaceRegistration> refine_surfaces(const TriangleMesh& after, const TriangleMesh& before,
                                            const Similarity3d& before_from_after,
                                            const ComparisonOptions& options);

}  // namespace orbitfuse::comparison
