// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/progress.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/surface/ground.hpp"
#include "recon/surface/options.hpp"

// The surface of a scene from its trained fields: the depth that they show to the recorded cameras
// fused to a mesh, painted with their colours and temperatures.
namespace orbitfuse {

/// What a surface is made of. All poses and the box are in one world; each field is in the world of
/// its own poses, and `world_from_thermal` says how the thermal one lies.
struct SurfaceFields {
  const nerf::Field* visible = nullptr;  ///< null: the thermal field gives the form too
  const nerf::Field* thermal = nullptr;  ///< null: no temperatures
  Similarity3d world_from_thermal;
  std::vector<PosedView> visible_views, thermal_views;
};

struct FieldSurfaceOptions {
  SurfaceOptions surface;
  /// Of the pictures and depth maps that fields render: about a voxel a pixel.
  int visible_width_px = 400, thermal_width_px = 320;
  double min_opacity = 0.5;  ///< below it a ray met too little for its value to be a surface's
  /// nerf::RenderOptions::surface_light of the depth: chosen on two scenes, held out on a third
  /// (docs/notes/export.md).
  double surface_light = 0.7;
  bool depth_noise = false;  ///< FieldSurface::depth_noise is wanted
  Status validate() const;
};

struct FieldSurface {
  TriangleMesh mesh;  ///< normals; colours, temperatures (kelvin) as there are fields for them
  std::size_t uncolored = 0;            ///< vertices that no visible view sees: gray
  std::size_t without_temperature = 0;  ///< vertices that no thermal view sees: NaN
  std::size_t fused_triangles = 0;      ///< before it was simplified
  std::optional<GroundPlane> ground;    ///< that was left out
  /// How far each view's depth lies from the mesh at each vertex, mean over the views that see it,
  /// in the poses' unit; NaN: none does. Empty unless asked for.
  std::vector<float> depth_noise;
};

/// The box of what cameras went round: a cube about the point that they look at, with the object's
/// reach (looked_at.hpp). Errors: input (orbit_geometry's).
Result<Eigen::AlignedBox3d> object_box(const std::vector<PosedView>& views);

/// Errors: usage (options), input (no field, no view), quality (no surface in the box), cancelled,
/// the renderer's.
Result<FieldSurface> field_surface(const SurfaceFields& fields, const Eigen::AlignedBox3d& box,
                                   const FieldSurfaceOptions& options, const Progress& progress);

}  // namespace orbitfuse
