// SPDX-License-Identifier: BSD-3-Clause
#include "tests/capture/mat/rendered_room.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace orbitfuse::test {
namespace {

struct Box {
  Eigen::Vector3d low, high;
};

/// One on the mat, the others 0.6 to 1.1 m from its middle.
const std::array<Box, 7> boxes{{{{-0.12, -0.07, 0}, {0.13, 0.06, 0.09}},
                                {{0.6, 0.1, 0}, {0.75, 0.25, 0.2}},
                                {{0.2, 0.7, 0}, {0.4, 0.8, 0.12}},
                                {{-0.7, 0.4, 0}, {-0.55, 0.6, 0.3}},
                                {{-0.9, -0.3, 0}, {-0.8, -0.1, 0.15}},
                                {{-0.2, -0.9, 0}, {0, -0.75, 0.2}},
                                {{0.6, -0.7, 0}, {0.8, -0.5, 0.1}}}};

double hash(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ull ^
                    static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4full ^
                    static_cast<std::uint64_t>(z) * 0x165667b19e3779f9ull;
  h ^= h >> 29;
  h *= 0xbf58476d1ce4e5b9ull;
  h ^= h >> 32;
  return static_cast<double>(h & 0xffff) / 65535;
}

/// Value noise, trilinear.
double noise(const Eigen::Vector3d& p) {
  const Eigen::Vector3d base = p.array().floor(), f = p - base;
  const auto x = static_cast<std::int64_t>(base.x()), y = static_cast<std::int64_t>(base.y()),
             z = static_cast<std::int64_t>(base.z());
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    sum += hash(x + i, y + j, z + k) * (i ? f.x() : 1 - f.x()) * (j ? f.y() : 1 - f.y()) *
           (k ? f.z() : 1 - f.z());
  }
  return sum;
}

double texture(const Eigen::Vector3d& p) { return 30 + 110 * noise(40 * p) + 80 * noise(9 * p); }

/// Distance along the ray to the box, infinity when missed (Kay and Kajiya, SIGGRAPH 1986).
double hit(const Box& box, const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  double near = 0, far = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double a = (box.low[i] - eye[i]) / ray[i], b = (box.high[i] - eye[i]) / ray[i];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return near > 0 && near <= far ? near : std::numeric_limits<double>::infinity();
}

}  // namespace

cv::Mat view_of_room(const cv::Mat& mat, double mat_size_m, const Camera& camera,
                     const Rigid3d& cam_from_mat) {
  const Eigen::Vector3d eye = camera_center(cam_from_mat);
  const Eigen::Matrix3d world_from_cam = cam_from_mat.rotation.conjugate().toRotationMatrix();
  cv::Mat image(camera.height, camera.width, CV_8UC1);
  const auto value = [&](const Eigen::Vector3d& ray) {
    double along = ray.z() < 0 ? -eye.z() / ray.z() : std::numeric_limits<double>::infinity();
    bool floor = true;
    for (const Box& box : boxes) {
      if (const double t = hit(box, eye, ray); t < along) along = t, floor = false;
    }
    if (!std::isfinite(along) || along > 6) return 90.0;
    const Eigen::Vector3d p = eye + along * ray;
    const int u = static_cast<int>(std::floor((p.x() / mat_size_m + 0.5) * mat.cols));
    const int v = static_cast<int>(std::floor((0.5 - p.y() / mat_size_m) * mat.rows));
    if (floor && u >= 0 && u < mat.cols && v >= 0 && v < mat.rows)
      return double{mat.at<std::uint8_t>(v, u) * 1.0};
    return texture(p);
  };
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int s = 0; s < 4; ++s) {
        sum += value(world_from_cam *
                     Eigen::Vector3d((x + 0.25 + 0.5 * (s % 2) - camera.cx) / camera.fx,
                                     (y + 0.25 + 0.5 * (s / 2) - camera.cy) / camera.fy, 1));
      }
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(sum / 4);
    }
  }
  return image;
}

}  // namespace orbitfuse::test
