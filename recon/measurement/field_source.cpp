// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/field_source.hpp"

#include <limits>

#include "recon/assembly/field_surface.hpp"

namespace orbitfuse::measurement {

FieldRenderer field_renderer(std::shared_ptr<const nerf::Field> thermal,
                             const Similarity3d& world_from_thermal, double min_opacity) {
  return [thermal = std::move(thermal), world_from_thermal, min_opacity](
             const Camera& camera, const Rigid3d& cam_from_world,
             const Progress& progress) -> Result<FieldView> {
    const Similarity3d thermal_from_world = world_from_thermal.inverse();
    ORBITFUSE_ASSIGN(
        const nerf::RenderedView seen,
        nerf::render(*thermal, camera, rebase(cam_from_world, thermal_from_world), {}, progress));
    FieldView view{seen.color.clone(), seen.depth * world_from_thermal.scale};
    view.temperature_k.setTo(std::numeric_limits<float>::quiet_NaN(), seen.opacity < min_opacity);
    return view;
  };
}

DepthRenderer surface_renderer(std::shared_ptr<const nerf::Field> field,
                               const Similarity3d& world_from_field) {
  return [field = std::move(field), world_from_field](const Camera& camera,
                                                      const Rigid3d& cam_from_world,
                                                      const Progress& progress) -> Result<cv::Mat> {
    const FieldSurfaceOptions exported;
    nerf::RenderOptions how;
    how.surface_light = exported.surface_light;
    ORBITFUSE_ASSIGN(
        const nerf::RenderedView seen,
        nerf::render(*field, camera, rebase(cam_from_world, world_from_field.inverse()), how,
                     progress));
    cv::Mat depth = seen.depth * world_from_field.scale;
    depth.setTo(std::numeric_limits<float>::quiet_NaN(), seen.opacity < exported.min_opacity);
    return depth;
  };
}

}  // namespace orbitfuse::measurement
