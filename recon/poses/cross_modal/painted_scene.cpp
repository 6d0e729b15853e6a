// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/painted_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "core/geometry/lifted.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/numeric/bilinear.hpp"
#include "recon/alignment/edge_field.hpp"

namespace orbitfuse {
namespace {

using Painters = std::vector<Painter>;

constexpr float unpainted = std::numeric_limits<float>::quiet_NaN();

/// What the painter saw at a point of the world; NaN where it saw something else or nothing.
float seen_by(const Painter& painter, const Eigen::Vector3d& point, double depth_tolerance) {
  const Eigen::Vector3d in_cam = painter.cam_from_world * point;
  const Eigen::Vector2d pixel = painter.camera.project(in_cam);
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  const auto place = place_among<float>(painter.image.cols, painter.image.rows, x, y);
  if (!place) return unpainted;
  const auto depth = static_cast<double>(
      painter.depth.at<float>(static_cast<int>(std::lround(y)), static_cast<int>(std::lround(x))));
  if (!(std::abs(depth - in_cam.z()) < depth_tolerance * in_cam.z())) return unpainted;
  return blended(*place, [&](int row, int column) { return painter.image.at<float>(row, column); });
}

/// The render's depth as points of the world, empty depth as NaN.
std::vector<Eigen::Vector3d> world_points(const cv::Mat& depth, const Camera& camera,
                                          const Rigid3d& cam_from_world) {
  const Rigid3d world_from_cam = cam_from_world.inverse();
  std::vector<Eigen::Vector3d> points;
  points.reserve(depth.total());
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      points.push_back(world_from_cam * lifted(depth, camera, x, y));
  return points;
}

cv::Mat layer_of(const Painter& painter, const std::vector<Eigen::Vector3d>& points,
                 const cv::Size& size, double depth_tolerance) {
  cv::Mat layer(size, CV_32F);
  for (std::size_t p = 0; p < points.size(); ++p)
    layer.ptr<float>()[p] = seen_by(painter, points[p], depth_tolerance);
  return layer;
}

/// Fills what is not painted yet, brought to the level of what is.
void paint(const cv::Mat& layer, cv::Mat& painting) {
  double difference = 0;
  int both = 0;
  for (int y = 0; y < layer.rows; ++y)
    for (int x = 0; x < layer.cols; ++x) {
      const float d = painting.at<float>(y, x) - layer.at<float>(y, x);
      if (std::isfinite(d)) difference += static_cast<double>(d), ++both;
    }
  const auto level = static_cast<float>(both > 0 ? difference / both : 0);
  for (int y = 0; y < layer.rows; ++y)
    for (int x = 0; x < layer.cols; ++x) {
      float& value = painting.at<float>(y, x);
      if (!std::isfinite(value)) value = layer.at<float>(y, x) + level;
    }
}

/// Painters by how little their direction of view differs, nearest first.
std::vector<const Painter*> nearest(const Painters& painters, const Rigid3d& cam_from_world,
                                    const PaintedSceneOptions& options) {
  const auto turned = [&](const Painter* p) {
    return rotation_angle_deg(p->cam_from_world.rotation, cam_from_world.rotation);
  };
  std::vector<const Painter*> near;
  for (const Painter& painter : painters)
    if (turned(&painter) >= options.min_turn_deg) near.push_back(&painter);
  const auto kept = std::min(near.size(), static_cast<std::size_t>(std::max(options.painters, 0)));
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), near.end(),
                    [&](const Painter* a, const Painter* b) { return turned(a) < turned(b); });
  near.resize(kept);
  return near;
}

/// Compared at this width.
constexpr int correlated_width_px = 160;
/// Fewer painted pixels say nothing.
constexpr double min_painted_share = 0.08;

/// Over the pixels that are painted; nothing where they are too few.
std::optional<double> painted_correlation(const cv::Mat& painting, const cv::Mat& image) {
  double n = 0, sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0;
  for (int y = 0; y < painting.rows; ++y)
    for (int x = 0; x < painting.cols; ++x) {
      const auto a = static_cast<double>(painting.at<float>(y, x));
      const auto b = static_cast<double>(image.at<float>(y, x));
      if (!std::isfinite(a) || !std::isfinite(b)) continue;
      n += 1, sx += a, sy += b;
    }
  if (n < min_painted_share * static_cast<double>(painting.total())) return std::nullopt;
  const double mx = sx / n, my = sy / n;
  for (int y = 0; y < painting.rows; ++y)
    for (int x = 0; x < painting.cols; ++x) {
      const double a = static_cast<double>(painting.at<float>(y, x)) - mx;
      const double b = static_cast<double>(image.at<float>(y, x)) - my;
      if (!std::isfinite(a) || !std::isfinite(b)) continue;
      sxx += a * a, syy += b * b, sxy += a * b;
    }
  if (!(sxx > 0 && syy > 0)) return std::nullopt;
  return sxy / std::sqrt(sxx * syy);
}

}  // namespace

cv::Mat painted_by(const Painter& painter, const cv::Mat& depth, const Camera& camera,
                   const Rigid3d& cam_from_world, double depth_tolerance) {
  return layer_of(painter, world_points(depth, camera, cam_from_world), depth.size(),
                  depth_tolerance);
}

Result<SceneRenderer> painted_scene(const SceneRenderer& renderer,
                                    const std::vector<PosedView>& views,
                                    const std::vector<cv::Mat>& images,
                                    const PaintedSceneOptions& options, const Progress& progress) {
  const auto painters = std::make_shared<Painters>();
  for (std::size_t i = 0; i < std::min(views.size(), images.size()); ++i) {
    ORBITFUSE_TRY(progress.check("poses.thermal"));
    Painter painter;
    painter.camera = narrowed_to(views[i].camera, options.width_px).without_distortion();
    painter.cam_from_world = views[i].cam_from_world;
    painter.image = reduced_to(images[i], painter.camera);
    ORBITFUSE_ASSIGN(const SceneRender seen, renderer(painter.camera, painter.cam_from_world));
    painter.depth = seen.depth;
    painters->push_back(std::move(painter));
  }
  return [&renderer, painters, options](const Camera& camera,
                                        const Rigid3d& cam_from_world) -> Result<SceneRender> {
    ORBITFUSE_ASSIGN(SceneRender view, renderer(camera, cam_from_world));
    const auto points = world_points(view.depth, camera, cam_from_world);
    view.brightness = cv::Mat(view.depth.size(), CV_32F, cv::Scalar(unpainted));
    for (const Painter* painter : nearest(*painters, cam_from_world, options))
      paint(layer_of(*painter, points, view.depth.size(), options.depth_tolerance),
            view.brightness);
    return view;
  };
}

Result<std::optional<double>> correlation_with(const SceneRenderer& painted, const cv::Mat& image,
                                               const PosedView& view) {
  const Camera camera = narrowed_to(view.camera, correlated_width_px).without_distortion();
  ORBITFUSE_ASSIGN(const SceneRender painting, painted(camera, view.cam_from_world));
  return painted_correlation(painting.brightness, reduced_to(image, camera));
}

}  // namespace orbitfuse
