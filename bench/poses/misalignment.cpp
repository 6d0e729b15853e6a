// SPDX-License-Identifier: BSD-3-Clause
#include "bench/poses/misalignment.hpp"

#include <algorithm>

#include "core/geometry/lifted.hpp"
#include "core/geometry/narrowed.hpp"

namespace orbitfuse::scenes {
namespace {

/// Views by how near their direction to the scene's point is to the new camera's.
std::vector<const PosedView*> nearest_first(const Reconstruction& model,
                                            const Eigen::Vector3d& from,
                                            const Eigen::Vector3d& point) {
  std::vector<const PosedView*> views;
  for (const PosedView& view : model.views) views.push_back(&view);
  const auto cosine = [&](const PosedView* v) {
    return (camera_center(v->cam_from_world) - point).normalized().dot((from - point).normalized());
  };
  std::sort(views.begin(), views.end(), [&](auto* a, auto* b) { return cosine(a) > cosine(b); });
  return views;
}

/// Where the modality shows a scene point, less where it is, in the new camera's pixels.
std::optional<Eigen::Vector2d> displacement(const std::vector<const PosedView*>& views,
                                            const Truth& truth,
                                            const Similarity3d& truth_from_model,
                                            const PosedView& seen_by,
                                            const Eigen::Vector3d& point) {
  Eigen::Vector2d sum(0, 0);
  int count = 0;
  for (const PosedView* view : views) {
    const auto found = truth.views.find(view->name);
    if (found == truth.views.end()) continue;
    const PosedView& was = found->second;
    const Eigen::Vector2d pixel =
        was.camera.project(was.cam_from_world * (truth_from_model * point));
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < was.camera.width &&
          pixel.y() < was.camera.height))
      continue;
    const double depth = (view->cam_from_world * point).z();
    const Eigen::Vector3d believed =
        view->cam_from_world.inverse() * (depth * view->camera.ray_of(pixel));
    sum += seen_by.camera.project(seen_by.cam_from_world * believed) -
           seen_by.camera.project(seen_by.cam_from_world * point);
    if (++count == 3) break;
  }
  if (count == 0 || !sum.allFinite()) return std::nullopt;
  return sum / count;
}

}  // namespace

Result<Misalignment> misalignment(const Scene& scene, const Reconstruction& visible,
                                  const Reconstruction& thermal, const SceneRenderer& renderer) {
  Misalignment result;
  const auto truth_from_visible = truth_from_model(visible, scene.truth);
  if (!truth_from_visible) return result;
  const Similarity3d visible_from_truth = truth_from_visible->inverse();
  for (const PosedView& test : scene.test) {
    PosedView small = test;
    small.camera = narrowed_to(test.camera, 80).without_distortion();
    small.cam_from_world = rebase(test.cam_from_world, visible_from_truth);
    ORBITFUSE_ASSIGN(const SceneRender seen, renderer(small.camera, small.cam_from_world));
    const Eigen::Vector3d center = camera_center(small.cam_from_world);
    const Rigid3d world_from_cam = small.cam_from_world.inverse();
    const auto at = [&](int x, int y) {
      return world_from_cam * lifted(seen.depth, small.camera, x, y);
    };
    const Eigen::Vector3d middle = at(small.camera.width / 2, small.camera.height / 2);
    if (!middle.allFinite()) continue;
    const auto visible_views = nearest_first(visible, center, middle),
               thermal_views = nearest_first(thermal, center, middle);
    for (int y = 0; y < small.camera.height; ++y)
      for (int x = 0; x < small.camera.width; ++x) {
        const Eigen::Vector3d point = at(x, y);
        if (!point.allFinite()) continue;
        const auto of_visible =
            displacement(visible_views, scene.truth, *truth_from_visible, small, point);
        const auto of_thermal =
            displacement(thermal_views, scene.truth, *truth_from_visible, small, point);
        if (of_visible && of_thermal)
          result.px.push_back((*of_thermal - *of_visible).norm() * 640 / small.camera.width);
      }
  }
  return result;
}

}  // namespace orbitfuse::scenes
