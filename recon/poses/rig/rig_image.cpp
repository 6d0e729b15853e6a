// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/rig/rig_image.hpp"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/numeric/median.hpp"

namespace orbitfuse {

cv::Mat seen_from(const cv::Mat& source, const Camera& source_camera,
                  const Eigen::Quaterniond& target_from_source, const Camera& target) {
  // Reduced to the target's scale first: remap takes four samples of however many there are.
  const double ratio = std::min(1.0, target.fx / source_camera.fx);
  const Camera camera = source_camera.scaled_to(
      std::max(1, static_cast<int>(std::lround(source_camera.width * ratio))),
      std::max(1, static_cast<int>(std::lround(source_camera.height * ratio))));
  cv::Mat small;
  cv::resize(source, small, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  const Eigen::Matrix3d source_from_target = target_from_source.conjugate().toRotationMatrix();
  cv::Mat map_x(target.height, target.width, CV_32F), map_y = map_x.clone();
  for (int y = 0; y < target.height; ++y)
    for (int x = 0; x < target.width; ++x) {
      const Eigen::Vector3d ray = source_from_target * target.ray_of({x + 0.5, y + 0.5});
      Eigen::Vector2d pixel(-1e4, -1e4);
      if (ray.z() > 0.05) pixel = camera.pixel_of(ray.hnormalized());
      map_x.at<float>(y, x) = static_cast<float>(pixel.x() - 0.5);
      map_y.at<float>(y, x) = static_cast<float>(pixel.y() - 0.5);
    }
  cv::Mat seen;
  cv::remap(small, seen, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_CONSTANT,
            cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()));
  return seen;
}

cv::Mat sparse_depth(const std::vector<Eigen::Vector3d>& points, const Camera& camera) {
  constexpr int columns = 24;
  const int rows = std::max(1, columns * camera.height / std::max(camera.width, 1));
  std::vector<std::vector<double>> cells(static_cast<std::size_t>(columns * rows));
  std::vector<double> all;
  for (const Eigen::Vector3d& point : points) {
    if (point.z() <= 0) continue;
    const Eigen::Vector2d p = camera.project(point);
    if (!(p.x() >= 0 && p.y() >= 0 && p.x() < camera.width && p.y() < camera.height)) continue;
    const int x = std::min(columns - 1, static_cast<int>(p.x() * columns / camera.width)),
              y = std::min(rows - 1, static_cast<int>(p.y() * rows / camera.height));
    cells[static_cast<std::size_t>(y * columns + x)].push_back(point.z());
    all.push_back(point.z());
  }
  const double usual = all.empty() ? 1.0 : median(all);
  cv::Mat1f grid(rows, columns);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      // The nearest cell with points stands for an empty one.
      double depth = usual, nearest = std::numeric_limits<double>::infinity();
      for (int v = 0; v < rows; ++v)
        for (int u = 0; u < columns; ++u) {
          const auto& cell = cells[static_cast<std::size_t>(v * columns + u)];
          const double distance = std::hypot(u - x, v - y);
          if (cell.empty() || distance >= nearest) continue;
          nearest = distance;
          depth = median(cell);
        }
      grid(y, x) = static_cast<float>(depth);
    }
  cv::Mat depth;
  cv::resize(grid, depth, {camera.width, camera.height}, 0, 0, cv::INTER_NEAREST);
  return depth;
}

}  // namespace orbitfuse
