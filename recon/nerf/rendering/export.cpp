// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <unordered_set>

#include "core/geometry/lens_fold.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"
#include "recon/nerf/kept_renders.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/rendering/render.hpp"

namespace orbitfuse::nerf {
namespace {

struct DepthView {
  Camera camera;                                             ///< at the rendered size
  std::shared_ptr<const std::vector<Eigen::Vector3d>> rays;  ///< of its pixels, z = 1
  RenderedView image;
  Rigid3d world_from_cam;
  Eigen::Matrix3d rotation;  ///< these two: to the camera
  Eigen::Vector3d translation;
  double fold;  ///< fold_of() the camera
};

Eigen::Vector3d lift(const DepthView& from, int x, int y) {
  const auto pixel = static_cast<std::size_t>(y * from.camera.width + x);
  return from.world_from_cam * ((*from.rays)[pixel] * from.image.depth.at<float>(y, x));
}

std::vector<Eigen::Vector3d> rays_of(const Camera& camera) {
  std::vector<Eigen::Vector3d> rays(static_cast<std::size_t>(camera.width * camera.height));
  parallel_blocks(camera.height, 16, [&](int begin, int end) {
    for (int y = begin; y < end; ++y)
      for (int x = 0; x < camera.width; ++x)
        rays[static_cast<std::size_t>(y * camera.width + x)] = camera.ray_of({x + 0.5, y + 0.5});
  });
  return rays;
}

/// Normal by the cross product of central differences; zero beside a depth step or a border.
Eigen::Vector3d normal_at(const DepthView& from, int x, int y) {
  const cv::Mat& depth = from.image.depth;
  if (x < 1 || y < 1 || x + 1 >= depth.cols || y + 1 >= depth.rows) return Eigen::Vector3d::Zero();
  const float z = depth.at<float>(y, x);
  for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
    if (!(std::abs(depth.at<float>(y + dy, x + dx) - z) < 0.05f * z))
      return Eigen::Vector3d::Zero();
  const Eigen::Vector3d n = (lift(from, x + 1, y) - lift(from, x - 1, y))
                                .cross(lift(from, x, y + 1) - lift(from, x, y - 1));
  const Eigen::Vector3d to_camera = from.world_from_cam.translation - lift(from, x, y);
  const double length = n.norm();
  if (!(length > 0)) return Eigen::Vector3d::Zero();
  return n / length * (n.dot(to_camera) < 0 ? -1.0 : 1.0);
}

/// Other views whose own depth agrees with this point, and views that see through it (a floater).
struct Agreement {
  int agree = 0, see_through = 0;
};

Agreement agreement(const std::vector<DepthView>& views, std::size_t self,
                    const Eigen::Vector3d& point, double tolerance) {
  Agreement result;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i == self) continue;
    const Eigen::Vector3d in_cam = views[i].rotation * point + views[i].translation;
    if (!(in_cam.z() > 0)) continue;
    if (in_cam.head<2>().squaredNorm() >= views[i].fold * in_cam.z() * in_cam.z()) continue;
    const Eigen::Vector2d pixel = views[i].camera.project(in_cam);
    const cv::Mat& depth = views[i].image.depth;
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < depth.cols && pixel.y() < depth.rows))
      continue;
    const float z = depth.at<float>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
    if (!std::isfinite(z)) continue;
    if (std::abs(z - in_cam.z()) <= tolerance * in_cam.z()) ++result.agree;
    if (z > in_cam.z() * (1 + 5 * tolerance)) ++result.see_through;
  }
  return result;
}

std::uint64_t voxel_key(const Eigen::Vector3d& p, double size) {
  std::uint64_t key = 0;
  for (int d = 0; d < 3; ++d)
    key =
        (key << 21) |
        (static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(p[d] / size))) & 0x1FFFFF);
  return key;
}

/// A pixel's point that other views agree with.
struct SurfacePoint {
  int x, y;
  Eigen::Vector3d point, normal;
};

void append(PointCloud& cloud, const DepthView& from, const SurfacePoint& p, Modality modality) {
  cloud.positions.push_back(p.point);
  cloud.normals.push_back(p.normal.cast<float>());
  if (modality == Modality::thermal) {
    cloud.temperatures_k.push_back(from.image.color.at<float>(p.y, p.x));
    return;
  }
  const auto rgb = from.image.color.at<cv::Vec3f>(p.y, p.x);
  cloud.colors.push_back({cv::saturate_cast<std::uint8_t>(255 * rgb[0]),
                          cv::saturate_cast<std::uint8_t>(255 * rgb[1]),
                          cv::saturate_cast<std::uint8_t>(255 * rgb[2])});
}

}  // namespace

Status ExportOptions::validate() const {
  const OptionCheck check("export");
  ORBITFUSE_TRY(check("max_width", max_width, at_least(8)));
  ORBITFUSE_TRY(check("min_consistent_views", min_consistent_views, at_least(0)));
  ORBITFUSE_TRY(check("depth_tolerance", depth_tolerance, between(0, 1)));
  ORBITFUSE_TRY(check("max_distance", max_distance, above(0)));
  return check("voxel", voxel, at_least(0));
}

Result<PointCloud> export_point_cloud(const Field& field, const std::vector<PosedView>& views,
                                      const ExportOptions& options, const Progress& progress,
                                      KeptRenders* kept) {
  ORBITFUSE_TRY(options.validate());
  if (views.empty())
    return fail(ErrorKind::input, "export.views", "no camera to see the field from",
                "pass the training views");
  const TraceSpan span("point cloud");
  std::vector<DepthView> rendered;
  for (const PosedView& view : views) {
    ORBITFUSE_TRY(progress.check("export"));
    const Camera camera = narrowed_to(view.camera, options.max_width);
    ORBITFUSE_ASSIGN(RenderedView image,
                     render_where_it_stands(field, view, camera, kept, progress));
    // Taking a lens' distortion back takes longer than all else: once for all views of a camera.
    auto rays = !rendered.empty() && rendered.back().camera == camera
                    ? rendered.back().rays
                    : std::make_shared<const std::vector<Eigen::Vector3d>>(rays_of(camera));
    rendered.push_back({camera, std::move(rays), std::move(image), view.cam_from_world.inverse(),
                        view.cam_from_world.rotation.toRotationMatrix(),
                        view.cam_from_world.translation, fold_of(camera)});
    progress.report({"export",
                     static_cast<double>(rendered.size()),
                     static_cast<double>(views.size()),
                     {},
                     view.name});
  }

  const int needed =
      std::min<int>(options.min_consistent_views, static_cast<int>(views.size()) - 1);
  const double reach = options.max_distance * field.radius(),
               voxel = options.voxel * field.radius();
  PointCloud cloud;
  std::unordered_set<std::uint64_t> taken;
  for (std::size_t i = 0; i < rendered.size(); ++i) {
    const cv::Mat& depth = rendered[i].image.depth;
    std::vector<std::vector<SurfacePoint>> rows(static_cast<std::size_t>(depth.rows));
    parallel_for(depth.rows, [&](int y) {
      for (int x = y % 2; x < depth.cols; x += 2) {
        if (!std::isfinite(depth.at<float>(y, x))) continue;
        const Eigen::Vector3d point = lift(rendered[i], x, y);
        if ((point - field.center()).norm() > reach) continue;
        const Agreement votes = agreement(rendered, i, point, options.depth_tolerance);
        if (votes.agree < needed || votes.see_through > votes.agree) continue;
        const Eigen::Vector3d normal = normal_at(rendered[i], x, y);
        if (!normal.isZero()) rows[static_cast<std::size_t>(y)].push_back({x, y, point, normal});
      }
    });
    for (const auto& row : rows)
      for (const SurfacePoint& p : row)
        if (voxel <= 0 || taken.insert(voxel_key(p.point, voxel)).second)
          append(cloud, rendered[i], p, field.modality());
  }
  if (cloud.empty())
    return fail(ErrorKind::quality, "export", "no point is consistent over the views",
                "train longer, or lower export.min_consistent_views");
  return cloud;
}

}  // namespace orbitfuse::nerf
