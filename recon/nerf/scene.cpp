// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/scene.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Dense maps first, then sparse points where no map has a value.
cv::Mat known_distance(const Dataset& dataset, const Space& space, int index,
                       const ViewRays& rays) {
  const Camera& camera = rays.camera();
  cv::Mat out(camera.height, camera.width, CV_32FC1, cv::Scalar(unknown));
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
        const int mx = static_cast<int>(std::floor(at.x())), my = static_cast<int>(std::floor(at.y()));
        if (!(mx >= 0 && my >= 0 && mx < map.depth.cols && my < map.depth.rows)) continue;
        const float z = map.depth.at<float>(my, mx);
        const float trust = map.confidence.empty() ? 1.0f : map.confidence.at<float>(my, mx);
        if (!(z > 0) || !std::isfinite(z) || !(trust >= 0.5f)) continue;
        out.at<float>(y, x) = z / static_cast<float>(space.radius) / ray.forward;
      }
  }
  for (const SparsePoint& point : dataset.points)
    for (const Observation& o : point.track) {
      if (o.view != index) continue;
      const int x = static_cast<int>(std::floor(o.pixel.x())), y = static_cast<int>(std::floor(o.pixel.y()));
      if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) continue;
      float& d = out.at<float>(y, x);
      if (!std::isfinite(d))
        d = static_cast<float>((space.normalized(point.position) - rays.origin()).norm());
    }
  return out;
}

}  // namespace

Space estimate_space(const Dataset& dataset) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero(), mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  for (const TrainingView& view : dataset.views) {
    const Eigen::Vector3d c = camera_center(view.cam_from_world);
    const Eigen::Vector3d d = view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Matrix3d off_axis = Eigen::Matrix3d::Identity() - d * d.transpose();
    a += off_axis;
    b += off_axis * c;
    mean += c;
    forward += d;
  }
  const double n = static_cast<double>(dataset.views.size());
  mean /= n;
  Space space;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(a);
  const bool axes_meet = eigen.eigenvalues()(0) > 1e-3 * n;
  if (axes_meet) {
    space.center = a.ldlt().solve(b);
  } else if (!dataset.points.empty()) {
    for (int i = 0; i < 3; ++i) {
      std::vector<double> values;
      for (const SparsePoint& p : dataset.points) values.push_back(p.position[i]);
      space.center[i] = median(values);
    }
  } else {
    double spread = 0;
    for (const TrainingView& view : dataset.views)
      spread = std::max(spread, (camera_center(view.cam_from_world) - mean).norm());
    space.center = mean + forward.normalized() * (spread > 0 ? 2 * spread : 1.0);
  }
  double distance = 0;
  for (const TrainingView& view : dataset.views)
    distance += (camera_center(view.cam_from_world) - space.center).norm() / n;
  space.radius = std::isfinite(distance) && distance > 0 ? distance : 1.0;
  return space;
}

ValueSpan estimate_span(const Dataset& dataset) {
  if (dataset.modality == Modality::visible) return {0, 1};
  std::vector<float> samples;
  for (const TrainingView& view : dataset.views)
    for (int y = 0; y < view.image.rows; y += 4)
      for (int x = 0; x < view.image.cols; x += 4)
        if (const float v = view.image.at<float>(y, x); std::isfinite(v)) samples.push_back(v);
  if (samples.empty()) return {0, 1};
  const auto at = [&](double q) {
    const auto i = static_cast<std::ptrdiff_t>(q * static_cast<double>(samples.size() - 1));
    std::nth_element(samples.begin(), samples.begin() + i, samples.end());
    return static_cast<double>(samples[static_cast<std::size_t>(i)]);
  };
  const double low = at(0.001), high = at(0.999);
  return {low, std::max(high, low + 1.0)};
}

std::vector<SceneView> prepare_views(const Dataset& dataset, const Space& space, ValueSpan span) {
  std::vector<SceneView> out(dataset.views.size());
  parallel_for(static_cast<int>(out.size()), [&](int i) {
    const TrainingView& view = dataset.views[static_cast<std::size_t>(i)];
    SceneView& scene = out[static_cast<std::size_t>(i)];
    scene.name = view.name;
    scene.rays = ViewRays(view.camera, view.cam_from_world, space);
    view.image.convertTo(scene.target, -1, 1.0 / (span.high - span.low),
                         -span.low / (span.high - span.low));
    scene.distance = known_distance(dataset, space, i, scene.rays);
    for (int p = 0; p < view.camera.width * view.camera.height; ++p)
      if (std::isfinite(scene.distance.at<float>(p / view.camera.width, p % view.camera.width)))
        scene.known.push_back(p);
  });
  return out;
}

}  // namespace orbitfuse::nerf
