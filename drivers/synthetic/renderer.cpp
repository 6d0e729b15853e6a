// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/system/parallel.hpp"
#include "drivers/synthetic/shading.hpp"

namespace orbitfuse::synthetic {
namespace {

using Eigen::Vector3d;

class RayMaker {
 public:
  RayMaker(const Camera& camera, const Rigid3d& cam_from_world)
      : camera_(camera), world_from_cam_(cam_from_world.inverse()) {}
  Ray at(double u, double v) const {
    return {world_from_cam_.translation,
            (world_from_cam_.rotation * camera_.ray_of({u, v})).normalized()};
  }
  Vector3d forward() const { return world_from_cam_.rotation * Vector3d::UnitZ(); }

 private:
  const Camera& camera_;
  Rigid3d world_from_cam_;
};

/// Mean of fn(ray) over a regular grid of samples in the pixel.
template <class Value, class Fn>
Value mean_over_pixel(const RayMaker& rays, int x, int y, int n, Value sum, const Fn& fn) {
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) sum += fn(rays.at(x + (i + 0.5) / n, y + (j + 0.5) / n));
  }
  return sum / (n * n);
}

double srgb(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

}  // namespace

cv::Mat render_visible(const Scene& scene, const Camera& camera, const Rigid3d& cam_from_world,
                       int samples_per_axis) {
  const RayMaker rays(camera, cam_from_world);
  cv::Mat image(camera.height, camera.width, CV_8UC3);
  parallel_for(camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vector3d rgb = mean_over_pixel(
          rays, x, y, samples_per_axis, Vector3d(Vector3d::Zero()),
          [&](const Ray& ray) { return visible_radiance(scene, ray, scene.intersect(ray)); });
      for (int c = 0; c < 3; ++c) {
        image.at<cv::Vec3b>(y, x)[2 - c] =
            static_cast<unsigned char>(std::lround(255 * srgb(rgb[c])));
      }
    }
  });
  return image;
}

cv::Mat render_thermal(const Scene& scene, const Camera& camera, const Rigid3d& cam_from_world,
                       int samples_per_axis) {
  const RayMaker rays(camera, cam_from_world);
  cv::Mat kelvin(camera.height, camera.width, CV_32FC1);
  parallel_for(camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      kelvin.at<float>(y, x) = static_cast<float>(mean_over_pixel(
          rays, x, y, samples_per_axis, 0.0,
          [&](const Ray& ray) { return temperature_k(scene, ray, scene.intersect(ray)); }));
    }
  });
  return kelvin;
}

cv::Mat render_depth(const Scene& scene, const Camera& camera, const Rigid3d& cam_from_world) {
  const RayMaker rays(camera, cam_from_world);
  cv::Mat depth(camera.height, camera.width, CV_32FC1);
  parallel_for(camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      const Ray ray = rays.at(x + 0.5, y + 0.5);
      const Hit hit = scene.intersect(ray);
      depth.at<float>(y, x) =
          hit.solid ? static_cast<float>(hit.distance * ray.direction.dot(rays.forward()))
                    : std::numeric_limits<float>::quiet_NaN();
    }
  });
  return depth;
}

}  // namespace orbitfuse::synthetic
