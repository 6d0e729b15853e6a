// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/progress.hpp"
#include "recon/comparison/options.hpp"

namespace orbitfuse::comparison {

/// What one run says of a place on the other's surface.
enum class SurfaceChange : std::uint8_t {
  same = 0,      ///< it has a surface there
  changed = 1,   ///< its cameras saw through the place: what is there came, or moved
  not_seen = 2,  ///< none of its cameras saw the place: hidden, outside of all pictures, a hole
};
const char* name(SurfaceChange change);

/// A surface with what is known of its depth.
struct KnownSurface {
  const TriangleMesh* mesh = nullptr;  ///< with normals
  /// FieldSurface::depth_noise; NaN: not known, the median is taken.
  std::vector<float> depth_noise;
  std::vector<PosedView> views;  ///< cameras that made it, without distortion, of a few hundred px
};

/// One a vertex of `surface`, told by `other`. Errors: usage (options), input (a mesh that is empty
/// or has no normals, noise that is not one a vertex, a similarity that is none), cancelled.
Result<std::vector<SurfaceChange>> surface_change(const KnownSurface& surface,
                                                  const KnownSurface& other,
                                                  const Similarity3d& other_from_surface,
                                                  const ComparisonOptions& options,
                                                  const Progress& progress);

}  // namespace orbitfuse::comparison
