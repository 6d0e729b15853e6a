// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/field_surface.hpp"

#include <cmath>
#include <limits>

#include "core/geometry/narrowed.hpp"
#include "core/option_range.hpp"
#include "recon/assembly/looked_at.hpp"
#include "recon/assembly/new_views.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse {
namespace {

struct RenderedOrbit {
  std::vector<SurfaceView> depths;
  std::vector<PaintView> pictures;
};

/// A field as its own cameras see it, in the world.
Result<RenderedOrbit> rendered(const nerf::Field& field, const std::vector<PosedView>& views,
                               const Similarity3d& world_from_field, int width_px,
                               const FieldSurfaceOptions& options, const Progress& progress) {
  RenderedOrbit result;
  nerf::RenderOptions how;
  how.surface_light = options.surface_light;
  for (const PosedView& posed : views) {
    ORBITFUSE_TRY(progress.check("export"));
    progress.report({"export",
                     static_cast<double>(result.depths.size()),
                     static_cast<double>(views.size()),
                     {},
                     posed.name});
    PosedView view{posed.name, narrowed_to(posed.camera, width_px).without_distortion(),
                   posed.cam_from_world};
    ORBITFUSE_ASSIGN(
        nerf::RenderedView seen,
        nerf::render(field, view.camera, rebase(view.cam_from_world, world_from_field.inverse()),
                     how, progress));
    const cv::Scalar nothing = cv::Scalar::all(std::numeric_limits<double>::quiet_NaN());
    seen.color.setTo(nothing, seen.opacity < options.min_opacity);
    seen.depth.setTo(nothing, seen.opacity < options.min_opacity);
    result.depths.push_back({view, seen.depth * world_from_field.scale});
    result.pictures.push_back({std::move(view), seen.color});
  }
  return result;
}

std::uint8_t level(float share) { return cv::saturate_cast<std::uint8_t>(255 * share); }

Status add_colors(const RenderedOrbit& visible, double max_angle_deg, FieldSurface& surface,
                  const Progress& progress) {
  ORBITFUSE_ASSIGN(const Painted painted,
                   paint(surface.mesh, visible.pictures, max_angle_deg, progress));
  for (const cv::Vec3f& rgb : painted.values) {
    const bool known = std::isfinite(rgb[0]);
    surface.uncolored += !known;
    surface.mesh.vertices.colors.push_back(
        known ? std::array{level(rgb[0]), level(rgb[1]), level(rgb[2])}
              : std::array<std::uint8_t, 3>{128, 128, 128});
  }
  return {};
}

Status add_temperatures(const RenderedOrbit& thermal, double max_angle_deg, FieldSurface& surface,
                        const Progress& progress) {
  ORBITFUSE_ASSIGN(const Painted painted,
                   paint(surface.mesh, thermal.pictures, max_angle_deg, progress));
  for (const cv::Vec3f& kelvin : painted.values) {
    surface.without_temperature += !std::isfinite(kelvin[0]);
    surface.mesh.vertices.temperatures_k.push_back(kelvin[0]);
  }
  return {};
}

Status add_depth_noise(const RenderedOrbit& orbit, double max_angle_deg, FieldSurface& surface,
                       const Progress& progress) {
  std::vector<PaintView> off;
  for (const SurfaceView& seen : orbit.depths) {
    ORBITFUSE_TRY(progress.check("surface"));
    cv::Mat difference;
    cv::absdiff(seen.depth, mesh_depth(surface.mesh, seen.view), difference);
    off.push_back({seen.view, difference});
  }
  ORBITFUSE_ASSIGN(const Painted painted, paint(surface.mesh, off, max_angle_deg, progress));
  for (const cv::Vec3f& value : painted.values) surface.depth_noise.push_back(value[0]);
  return {};
}

/// How far above the ground the object begins.
double clearance_of(const GroundPlane& ground, const SurfaceOptions& options, double side) {
  return std::max(options.ground_clearance * side, 4 * ground.sigma);
}

Eigen::Vector3d up_of(const std::vector<PosedView>& views) {
  const auto orbit = orbit_geometry(views);
  return orbit ? orbit->up : Eigen::Vector3d::UnitZ();
}

}  // namespace

Status FieldSurfaceOptions::validate() const {
  const OptionCheck check("export");
  ORBITFUSE_TRY(check("visible_width_px", visible_width_px, from_to(16, 8192)));
  ORBITFUSE_TRY(check("thermal_width_px", thermal_width_px, from_to(16, 8192)));
  ORBITFUSE_TRY(check("min_opacity", min_opacity, from_to(0.0, 1.0)));
  ORBITFUSE_TRY(check("surface_light", surface_light, from_to(0.5, 0.95)));
  return surface.validate();
}

Result<Eigen::AlignedBox3d> object_box(const std::vector<PosedView>& views) {
  ORBITFUSE_ASSIGN(const OrbitGeometry orbit, orbit_geometry(views));
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(object_reach * orbit.radius);
  return Eigen::AlignedBox3d(orbit.center - half, orbit.center + half);
}

Result<FieldSurface> field_surface(const SurfaceFields& fields, const Eigen::AlignedBox3d& box,
                                   const FieldSurfaceOptions& options, const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  const bool has_visible = fields.visible && !fields.visible->empty(),
             has_thermal = fields.thermal && !fields.thermal->empty();
  if (!has_visible && !has_thermal)
    return fail(ErrorKind::input, "export", "no trained field", "train one first");
  if ((has_visible ? fields.visible_views : fields.thermal_views).empty())
    return fail(ErrorKind::input, "export", "no camera to see the field from",
                "pose the views first");
  RenderedOrbit visible, thermal;
  if (has_visible) {
    ORBITFUSE_ASSIGN(visible, rendered(*fields.visible, fields.visible_views, {},
                                       options.visible_width_px, options, progress));
  }
  if (has_thermal) {
    ORBITFUSE_ASSIGN(thermal,
                     rendered(*fields.thermal, fields.thermal_views, fields.world_from_thermal,
                              options.thermal_width_px, options, progress));
  }
  ORBITFUSE_ASSIGN(TriangleMesh fused, fuse_depth((has_visible ? visible : thermal).depths, box,
                                                  options.surface, progress));
  FieldSurface result;
  result.fused_triangles = fused.triangles.size();
  const double side = box.sizes().maxCoeff();
  if (options.surface.without_ground) {
    result.ground =
        find_ground(fused, box, up_of(has_visible ? fields.visible_views : fields.thermal_views));
    if (result.ground)
      fused = without_ground(fused, *result.ground,
                             clearance_of(*result.ground, options.surface, side));
  }
  result.mesh = simplified(without_small_pieces(fused, options.surface.least_piece * side),
                           options.surface.triangles);
  if (result.mesh.empty())
    return fail(ErrorKind::quality, "surface", "only loose pieces of it in the box",
                "lower surface.least_piece, or choose a larger box");
  result.mesh.vertices.normals = vertex_normals(result.mesh);
  const double angle = options.surface.max_angle_deg;
  if (options.depth_noise)
    ORBITFUSE_TRY(add_depth_noise(has_visible ? visible : thermal, angle, result, progress));
  if (has_visible) ORBITFUSE_TRY(add_colors(visible, angle, result, progress));
  if (has_thermal) ORBITFUSE_TRY(add_temperatures(thermal, angle, result, progress));
  return result;
}

}  // namespace orbitfuse
