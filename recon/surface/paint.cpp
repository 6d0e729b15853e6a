// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/numeric/bilinear.hpp"
#include "core/system/parallel.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse {
namespace {

/// A vertex is hidden where the mesh lies nearer than it by more than this share of its distance
/// (and by more than its own slope within a pixel).
constexpr double hidden_share = 0.01;
constexpr double beside_edge_weight = 0.05;

/// The picture between its pixels; nothing where one of them is NaN.
std::optional<cv::Vec3f> value_at(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  if (!(x >= 0 && y >= 0 && x <= image.cols - 1.0 && y <= image.rows - 1.0)) return std::nullopt;
  const cv::Vec3f value =
      blended(place_held<float>(image.cols, image.rows, x, y), [&](int row, int column) {
        if (image.type() == CV_32FC3) return image.at<cv::Vec3f>(row, column);
        return cv::Vec3f::all(image.at<float>(row, column));
      });
  for (int k = 0; k < 3; ++k)
    if (!std::isfinite(value[k])) return std::nullopt;
  return value;
}

/// How much a view's word counts; 0 where the mesh hides the vertex.
double visible_weight(const cv::Mat& depth, const Eigen::Vector2d& pixel, double z, double cosine) {
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  const double slack = hidden_share * z / std::max(cosine, 0.1);
  const double there = static_cast<double>(depth.at<float>(y, x));
  if (!(z <= there + slack)) return 0;  // where the mesh has no pixel at all, too
  const double weight = cosine * cosine * cosine;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const int nx = x + dx, ny = y + dy;
      if (nx < 0 || ny < 0 || nx >= depth.cols || ny >= depth.rows) continue;
      const double beside = static_cast<double>(depth.at<float>(ny, nx));
      if (!(std::abs(beside - z) <= 3 * slack)) return beside_edge_weight * weight;
    }
  return weight;
}

struct Seen {
  cv::Mat depth;
  Eigen::Vector3d eye;
};

Status check(const std::vector<PaintView>& views) {
  for (const PaintView& p : views) {
    const Camera& c = p.view.camera;
    if ((p.values.type() != CV_32FC1 && p.values.type() != CV_32FC3) || p.values.cols != c.width ||
        p.values.rows != c.height || c.has_distortion() || c.width < 2 || c.height < 2 ||
        !p.view.cam_from_world.is_finite())
      return fail(ErrorKind::input, p.view.name, "a picture that is not of its camera",
                  "render it again with that camera, without distortion");
  }
  return {};
}

}  // namespace

Result<Painted> paint(const TriangleMesh& mesh, const std::vector<PaintView>& views,
                      double max_angle_deg, const Progress& progress) {
  ORBITFUSE_TRY(check(views));
  std::vector<Seen> seen(views.size());
  parallel_for(static_cast<int>(views.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    if (progress.cancelled()) return;
    seen[k] = {mesh_depth(mesh, views[k].view), camera_center(views[k].view.cam_from_world)};
  });
  ORBITFUSE_TRY(progress.check("surface"));
  const std::vector<Eigen::Vector3f> normals = vertex_normals(mesh);
  const double least_cosine = std::cos(max_angle_deg * std::numbers::pi / 180);
  const std::size_t count = mesh.vertices.size();
  Painted result;
  result.values.assign(count, cv::Vec3f::all(std::numeric_limits<float>::quiet_NaN()));
  result.views.assign(count, 0);
  parallel_blocks(static_cast<int>(count), 4096, [&](int begin, int end) {
    for (auto v = static_cast<std::size_t>(begin); v < static_cast<std::size_t>(end); ++v) {
      const Eigen::Vector3d& p = mesh.vertices.positions[v];
      cv::Vec3d sum(0, 0, 0);
      double weights = 0;
      for (std::size_t k = 0; k < views.size(); ++k) {
        const Eigen::Vector3d to_eye = seen[k].eye - p;
        const double cosine = to_eye.normalized().dot(normals[v].cast<double>());
        if (!(cosine > least_cosine)) continue;
        const Eigen::Vector3d in_cam = views[k].view.cam_from_world * p;
        const Eigen::Vector2d pixel = views[k].view.camera.project(in_cam);
        if (!pixel.allFinite()) continue;
        const auto value = value_at(views[k].values, pixel);
        if (!value) continue;
        const double weight = visible_weight(seen[k].depth, pixel, in_cam.z(), cosine);
        if (!(weight > 0)) continue;
        sum += weight * cv::Vec3d((*value)[0], (*value)[1], (*value)[2]);
        weights += weight;
        ++result.views[v];
      }
      if (weights > 0)
        for (int c = 0; c < 3; ++c) result.values[v][c] = static_cast<float>(sum[c] / weights);
    }
  });
  return result;
}

}  // namespace orbitfuse
