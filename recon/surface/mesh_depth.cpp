// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "recon/surface/surface.hpp"

namespace orbitfuse {
namespace {

struct Corner {
  double u = 0, v = 0, inverse_z = 0;
};

double side_of(const Corner& a, const Corner& b, double u, double v) {
  return (b.u - a.u) * (v - a.v) - (b.v - a.v) * (u - a.u);
}

/// Pixel centres within the triangle, either way round; 1/z is linear over the picture.
void draw(const Corner& a, const Corner& b, const Corner& c, cv::Mat& depth) {
  const double area = side_of(a, b, c.u, c.v);
  if (area == 0 || !std::isfinite(area)) return;
  const auto [u_low, u_high] = std::minmax({a.u, b.u, c.u});
  const auto [v_low, v_high] = std::minmax({a.v, b.v, c.v});
  const int x0 = static_cast<int>(std::ceil(std::max(0.0, u_low - 0.5))),
            y0 = static_cast<int>(std::ceil(std::max(0.0, v_low - 0.5)));
  const int x1 = static_cast<int>(std::floor(std::min(depth.cols - 1.0, u_high - 0.5))),
            y1 = static_cast<int>(std::floor(std::min(depth.rows - 1.0, v_high - 0.5)));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const double u = x + 0.5, v = y + 0.5;
      const double of_a = side_of(b, c, u, v) / area, of_b = side_of(c, a, u, v) / area,
                   of_c = 1 - of_a - of_b;
      constexpr double slack = -1e-9;  // neighbours leave no gap between them
      if (of_a < slack || of_b < slack || of_c < slack) continue;
      const auto z =
          static_cast<float>(1 / (of_a * a.inverse_z + of_b * b.inverse_z + of_c * c.inverse_z));
      float& there = depth.at<float>(y, x);
      if (!(there <= z)) there = z;  // NaN: nothing was there
    }
}

}  // namespace

cv::Mat mesh_depth(const TriangleMesh& mesh, const PosedView& view) {
  CV_Assert(!view.camera.has_distortion());
  cv::Mat depth(view.camera.height, view.camera.width, CV_32FC1,
                cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  std::vector<Corner> corners;
  corners.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& p : mesh.vertices.positions) {
    const Eigen::Vector3d x = view.cam_from_world * p;
    const Eigen::Vector2d pixel = view.camera.project(x);
    corners.push_back({pixel.x(), pixel.y(), x.z() > 0 ? 1 / x.z() : 0});
  }
  for (const auto& t : mesh.triangles) {
    const Corner &a = corners[t[0]], &b = corners[t[1]], &c = corners[t[2]];
    if (a.inverse_z > 0 && b.inverse_z > 0 && c.inverse_z > 0) draw(a, b, c, depth);
  }
  return depth;
}

}  // namespace orbitfuse
