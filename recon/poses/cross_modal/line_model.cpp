// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/line_model.hpp"

#include <algorithm>
#include <cmath>

namespace orbitfuse {

LineModel::LineModel(const std::vector<EdgeLine>& lines,
                     const std::vector<Eigen::Vector3d>& view_centers, double max_view_angle_deg)
    : lines_(lines), min_cosine_(std::cos(max_view_angle_deg * 3.14159265358979323846 / 180.0)) {
  for (const EdgeLine& line : lines_) {
    std::vector<Eigen::Vector3d> directions;
    for (const int v : line.views)
      directions.push_back(
          (view_centers[static_cast<std::size_t>(v)] - 0.5 * (line.a + line.b)).normalized());
    directions_.push_back(std::move(directions));
  }
}

std::vector<LineModel::Sample> LineModel::samples(const Camera& camera,
                                                  const Rigid3d& cam_from_world,
                                                  double step_px) const {
  std::vector<Sample> result;
  const Eigen::Matrix3d rotation = cam_from_world.rotation.toRotationMatrix();
  const Eigen::Vector3d center = camera_center(cam_from_world);
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const EdgeLine& line = lines_[i];
    const Eigen::Vector3d toward = (center - 0.5 * (line.a + line.b)).normalized();
    const bool visible =
        std::any_of(directions_[i].begin(), directions_[i].end(),
                    [&](const Eigen::Vector3d& d) { return d.dot(toward) > min_cosine_; });
    if (!visible) continue;
    const Eigen::Vector3d ac = rotation * line.a + cam_from_world.translation;
    const Eigen::Vector3d bc = rotation * line.b + cam_from_world.translation;
    if (ac.z() <= 1e-6 || bc.z() <= 1e-6) continue;
    const Eigen::Vector2d pa = camera.pixel_of(ac.head<2>() / ac.z());
    const Eigen::Vector2d pb = camera.pixel_of(bc.head<2>() / bc.z());
    const Eigen::Vector2d span = pb - pa;
    const double length = span.norm();
    if (!(length > 0.5 * step_px)) continue;
    const Eigen::Vector2d normal(-span.y() / length, span.x() / length);
    const int count = std::clamp(static_cast<int>(length / step_px), 1, 400);
    for (int k = 0; k < count; ++k) {
      const double t = (k + 0.5) / count;
      // Pixels are spaced evenly; the depth-correct place on the line follows.
      const double along = t * ac.z() / (bc.z() + t * (ac.z() - bc.z()));
      const Eigen::Vector2d p = pa + t * span;
      if (p.x() < 0 || p.y() < 0 || p.x() >= camera.width || p.y() >= camera.height) continue;
      result.push_back({static_cast<int>(i), along, p, normal});
    }
  }
  return result;
}

}  // namespace orbitfuse
