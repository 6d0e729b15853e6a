// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/training/scene.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/scene_ball.hpp"
#include "core/geometry/seen_by_some.hpp"
#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float unknown_depth = std::numeric_limits<float>::quiet_NaN();

/// Dense maps first, then sparse points where no map has a value.
cv::Mat known_distance(const Dataset& dataset, const Space& space, int index,
                       const ViewRays& rays) {
  const Camera& camera = rays.camera();
  cv::Mat out(camera.height, camera.width, CV_32FC1, cv::Scalar(unknown_depth));
  for (const DepthMap& map : dataset.depth) {
    if (map.view != index) continue;
    const Rigid3d& pose = dataset.views[static_cast<std::size_t>(index)].cam_from_world;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        Ray ray;
        if (!rays.ray(x + 0.5, y + 0.5, ray)) continue;
        // The map's camera differs in size and has no distortion: follow the ray into it.
        const Eigen::Vector3d world(ray.direction[0], ray.direction[1], ray.direction[2]);
        const Eigen::Vector2d at = map.camera.project(pose.rotation * world);
        const int mx = static_cast<int>(std::floor(at.x())),
                  my = static_cast<int>(std::floor(at.y()));
        if (!(mx >= 0 && my >= 0 && mx < map.depth.cols && my < map.depth.rows)) continue;
        const float z = map.depth.at<float>(my, mx);
        const float trust = map.confidence.empty() ? 1.0f : map.confidence.at<float>(my, mx);
        if (!(z > 0) || !(trust >= 0.5f)) continue;
        out.at<float>(y, x) = z / static_cast<float>(space.radius) / ray.forward;
      }
  }
  for (const SparsePoint& point : dataset.points)
    for (const Observation& o : point.track) {
      if (o.view != index) continue;
      const int x = static_cast<int>(std::floor(o.pixel.x())),
                y = static_cast<int>(std::floor(o.pixel.y()));
      if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) continue;
      float& d = out.at<float>(y, x);
      if (!std::isfinite(d))
        d = static_cast<float>((space.normalized(point.position) - rays.origin()).norm());
    }
  return out;
}

}  // namespace

std::vector<bool> heldout_views(const Dataset& dataset, int holdout_every) {
  std::vector<bool> heldout;
  const auto trainable = std::count_if(dataset.views.begin(), dataset.views.end(),
                                       [](const TrainingView& view) { return !view.measure_only; });
  int turn = 0;  // only views that might train are counted: others change nothing
  for (const TrainingView& view : dataset.views) {
    const bool turned =
        !view.measure_only && holdout_every > 0 && trainable > 1 && turn++ % holdout_every == 0;
    heldout.push_back(view.measure_only || turned);
  }
  return heldout;
}

double invalid_share(const cv::Mat& image) {
  return 1 - cv::countNonZero(image == image) / static_cast<double>(image.total());
}

std::vector<bool> broken_views(const Dataset& dataset) {
  std::vector<bool> broken;
  for (const TrainingView& view : dataset.views)
    broken.push_back(dataset.modality == Modality::thermal && invalid_share(view.image) > 0.5);
  return broken;
}

std::vector<bool> left_out_views(const Dataset& given, int holdout_every) {
  std::vector<bool> out = broken_views(given);
  const std::vector<bool> heldout = heldout_views(training_part(given, out), holdout_every);
  auto next = heldout.begin();
  for (std::size_t i = 0; i < out.size(); ++i)
    if (!out[i]) out[i] = *next++;
  return out;
}

Dataset training_part(const Dataset& dataset, const std::vector<bool>& heldout) {
  Dataset part;
  part.modality = dataset.modality;
  part.thermal_is_gray = dataset.thermal_is_gray;
  part.counts = dataset.counts;
  std::vector<int> place(dataset.views.size(), -1);
  for (std::size_t i = 0; i < dataset.views.size(); ++i) {
    if (heldout[i]) continue;
    place[i] = static_cast<int>(part.views.size());
    part.views.push_back(dataset.views[i]);
  }
  for (const SparsePoint& point : dataset.points) {
    SparsePoint seen = seen_by_some(point, place);
    if (point.track.empty() || !seen.track.empty()) part.points.push_back(std::move(seen));
  }
  for (DepthMap map : dataset.depth) {
    map.view = place[static_cast<std::size_t>(map.view)];
    if (map.view >= 0) part.depth.push_back(std::move(map));
  }
  return part;
}

Space estimate_space(const Dataset& training) {
  std::vector<Rigid3d> poses;
  std::vector<Eigen::Vector3d> points;
  for (const TrainingView& view : training.views) poses.push_back(view.cam_from_world);
  for (const SparsePoint& point : training.points) points.push_back(point.position);
  const SceneBall ball = scene_ball(poses, std::move(points));
  return {ball.center, ball.radius};
}

ValueSpan estimate_span(const Dataset& training) {
  if (training.modality == Modality::visible) return {0, 1};
  std::vector<float> samples;
  for (const TrainingView& view : training.views)
    for (int y = 0; y < view.image.rows; y += 4)
      for (int x = 0; x < view.image.cols; x += 4)
        if (const float v = view.image.at<float>(y, x); std::isfinite(v)) samples.push_back(v);
  if (samples.empty()) return {0, 1};
  const double low = quantile(samples, 0.001), high = quantile(samples, 0.999);
  return {low, std::max(high, low + 1.0)};
}

cv::Mat normalised(const cv::Mat& image, ValueSpan span) {
  cv::Mat target;
  image.convertTo(target, -1, 1.0 / (span.high - span.low), -span.low / (span.high - span.low));
  return target;
}

std::vector<NormalisedView> prepare_views(const Dataset& dataset, const Space& space,
                                          ValueSpan span) {
  std::vector<NormalisedView> out(dataset.views.size());
  parallel_for(static_cast<int>(out.size()), [&](int i) {
    const TrainingView& view = dataset.views[static_cast<std::size_t>(i)];
    NormalisedView& scene = out[static_cast<std::size_t>(i)];
    scene.name = view.name;
    scene.rays = ViewRays(view.camera, view.cam_from_world, space);
    scene.target = normalised(view.image, span);
    scene.distance = known_distance(dataset, space, i, scene.rays);
    for (int p = 0; p < view.camera.width * view.camera.height; ++p)
      if (std::isfinite(scene.distance.at<float>(p / view.camera.width, p % view.camera.width)))
        scene.known.push_back(p);
  });
  return out;
}

}  // namespace orbitfuse::nerf
