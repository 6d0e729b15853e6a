// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/seen_before.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/lifted.hpp"
#include "core/geometry/narrowed.hpp"

namespace orbitfuse {
namespace {

constexpr int recorded_width_px = 64;  // 24 views are a fifth of a picture
constexpr int samples_along_width = 40;
// Between the rays of both views to a point: a surface's other side is more than 90 degrees off.
constexpr double least_cosine = 0.5;
// Of a small render at slanting surfaces; what hides a point is mostly much nearer.
constexpr double depth_tolerance = 0.1;

}  // namespace

Result<SeenBefore> SeenBefore::of(const SceneRenderer& scene, std::vector<PosedView> recorded) {
  SeenBefore before;
  for (PosedView& view : recorded) {
    view.camera = narrowed_to(view.camera.without_distortion(), recorded_width_px);
    ORBITFUSE_ASSIGN(SceneRender seen, scene(view.camera, view.cam_from_world));
    before.recorded_.push_back({view, camera_center(view.cam_from_world), std::move(seen.depth)});
  }
  return before;
}

bool SeenBefore::saw(const Eigen::Vector3d& point, const Eigen::Vector3d& seen_from) const {
  const Eigen::Vector3d to_new = (seen_from - point).normalized();
  return std::any_of(recorded_.begin(), recorded_.end(), [&](const Recorded& r) {
    if (!(to_new.dot((r.center - point).normalized()) >= least_cosine)) return false;
    const Eigen::Vector3d in_cam = r.view.cam_from_world * point;
    const Eigen::Vector2d pixel = r.view.camera.project(in_cam);  // NaN behind the camera
    if (!(pixel.minCoeff() >= 0 && pixel.x() < r.depth.cols && pixel.y() < r.depth.rows))
      return false;
    const float depth = r.depth.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
    return std::abs(depth - in_cam.z()) <= depth_tolerance * in_cam.z();
  });
}

SeenOfView SeenBefore::share_of(const PosedView& view, const cv::Mat& depth) const {
  CV_Assert(depth.type() == CV_32FC1 && depth.cols == view.camera.width &&
            depth.rows == view.camera.height);
  const int step = std::max(1, depth.cols / samples_along_width);
  const Rigid3d world_from_cam = view.cam_from_world.inverse();
  const Eigen::Vector3d center = camera_center(view.cam_from_world);
  int pixels = 0, surface = 0, seen = 0;
  for (int y = step / 2; y < depth.rows; y += step)
    for (int x = step / 2; x < depth.cols; x += step) {
      ++pixels;
      const Eigen::Vector3d in_cam = lifted(depth, view.camera, x, y);
      if (!in_cam.allFinite()) continue;
      ++surface;
      if (saw(world_from_cam * in_cam, center)) ++seen;
    }
  SeenOfView share;
  if (pixels > 0) share.surface = static_cast<double>(surface) / pixels;
  if (surface > 0) share.seen = static_cast<double>(seen) / surface;
  return share;
}

}  // namespace orbitfuse
