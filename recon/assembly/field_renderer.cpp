// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/field_renderer.hpp"

#include <opencv2/imgproc.hpp>

namespace orbitfuse {
namespace {

nerf::RenderOptions coarse() {
  nerf::RenderOptions options;
  options.sample_factor = 0.5;
  return options;
}

}  // namespace

SceneRenderer edge_renderer(const nerf::Field& field, const Progress& progress) {
  return [&](const Camera& camera, const Rigid3d& cam_from_world) -> Result<SceneRender> {
    ORBITFUSE_ASSIGN(const nerf::RenderedView seen,
                     nerf::render(field, camera, cam_from_world, coarse(), progress));
    SceneRender view{{}, seen.depth};
    cv::cvtColor(seen.color, view.brightness, cv::COLOR_RGB2GRAY);
    return view;
  };
}

SceneRenderer depth_renderer(const nerf::Field& field, const Progress& progress) {
  return [&](const Camera& camera, const Rigid3d& cam_from_world) -> Result<SceneRender> {
    ORBITFUSE_ASSIGN(const nerf::RenderedView seen,
                     nerf::render(field, camera, cam_from_world, coarse(), progress));
    return SceneRender{{}, seen.depth};
  };
}

}  // namespace orbitfuse
