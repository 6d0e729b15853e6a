// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "recon/comparison/surface_change.hpp"
#include "recon/measurement/thermal_scene.hpp"

namespace orbitfuse::comparison {

/// Temperature after minus before at one vertex. NaN: a run has none there, or the surface changed.
struct PointDifference {
  double difference_k = 0;
  /// The difference's error is below it in 90 of 100 cases, as far as frames show: both readings'
  /// own, and what the surfaces' distance makes of a gradient along the surface.
  double uncertainty_k = 0;
  double after_k = 0, before_k = 0;
  bool known() const { return std::isfinite(difference_k); }
};

/// Where the later run's surface lies in both, and how.
struct ComparedSurface {
  const TriangleMesh* after = nullptr;   ///< with normals; temperatures_k where the field has some
  const TriangleMesh* before = nullptr;  ///< the same, of the earlier run, in its own world
  Similarity3d before_from_after;
  double residual = 0;                ///< SurfaceRegistration::residual, BEFORE's unit
  std::vector<SurfaceChange> change;  ///< one a vertex of `after`
};

/// One a vertex of `after`; both readings by measurement::read_points of the original frames.
/// Errors: input (a change that is not one a vertex), read_points', cancelled.
Result<std::vector<PointDifference>> temperature_difference(const ComparedSurface& surface,
                                                            const measurement::ThermalScene& after,
                                                            const measurement::ThermalScene& before,
                                                            const Progress& progress);

/// What both days differ by as a whole: the median over the surface that holds still, by area.
/// None where nothing was compared.
std::optional<double> common_difference(const TriangleMesh& after,
                                        const std::vector<PointDifference>& points);

/// A third of the triangles' area at each vertex.
std::vector<double> vertex_areas(const TriangleMesh& mesh);

}  // namespace orbitfuse::comparison
