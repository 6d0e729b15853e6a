// SPDX-License-Identifier: BSD-3-Clause
#include "recon/depth/dense_depth.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/geometry/scene_ball.hpp"
#include "core/system/parallel.hpp"
#include "recon/depth/ground/extend_ground.hpp"
#include "recon/depth/ground/ground_plane.hpp"
#include "recon/depth/stereo/consistency.hpp"
#include "recon/depth/stereo/neighbours.hpp"
#include "recon/depth/stereo/patch_match.hpp"

namespace orbitfuse::depth {
namespace {

constexpr int min_side_px = 16;

SceneBall scene_of(const Reconstruction& model) {
  std::vector<Rigid3d> poses;
  std::vector<Eigen::Vector3d> points;
  for (const PosedView& view : model.views) poses.push_back(view.cam_from_world);
  for (const SparsePoint& point : model.points) points.push_back(point.position);
  return scene_ball(poses, std::move(points));
}

std::vector<Seed> seeds_of(const Reconstruction& model, int index, const DepthView& view,
                           const SceneBall& scene) {
  std::vector<Seed> seeds;
  for (const SparsePoint& point : model.points) {
    const bool seen = std::any_of(point.track.begin(), point.track.end(),
                                  [&](const Observation& o) { return o.view == index; });
    if (!seen) continue;
    const Eigen::Vector3f x = ((point.position - scene.center) / scene.radius).cast<float>();
    const Eigen::Vector3f c = view.world_rotation * x + view.translation;
    if (!(c.z() > 0)) continue;
    const Eigen::Vector2d at = view.camera.project(c.cast<double>());
    if (at.x() >= 0 && at.y() >= 0 && at.x() < view.camera.width && at.y() < view.camera.height)
      seeds.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()), c.z()});
  }
  return seeds;
}

Status check(const Reconstruction& model, const std::vector<cv::Mat>& images) {
  if (images.size() != model.views.size())
    return fail(ErrorKind::input, "depth",
                fmt::format("{} images for {} views", images.size(), model.views.size()),
                "give one image per view");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const PosedView& view = model.views[i];
    if (images[i].empty() || images[i].depth() != CV_8U ||
        (images[i].channels() != 1 && images[i].channels() != 3))
      return fail(ErrorKind::input, view.name, "not an 8-bit gray or BGR image", "convert it");
    if (images[i].cols != view.camera.width || images[i].rows != view.camera.height)
      return fail(ErrorKind::input, view.name,
                  fmt::format("image {}x{}, camera {}x{}", images[i].cols, images[i].rows,
                              view.camera.width, view.camera.height),
                  "scale the camera with the image");
    ORBITFUSE_TRY(view.camera.validate(view.name));
    if (!view.cam_from_world.is_finite())
      return fail(ErrorKind::input, view.name, "pose is not finite", "drop the view");
    if (images[i].cols < min_side_px || images[i].rows < min_side_px)
      return fail(ErrorKind::input, view.name,
                  fmt::format("{}x{} pixels", images[i].cols, images[i].rows),
                  fmt::format("depth needs at least {} pixels a side", min_side_px));
  }
  return {};
}

std::vector<SourceView> sources_of(const std::vector<DepthView>& views, std::size_t index,
                                   const std::vector<int>& neighbours) {
  std::vector<SourceView> sources;
  for (const int j : neighbours)
    sources.push_back(source_view(views[index], views[static_cast<std::size_t>(j)]));
  return sources;
}

/// Points of the sparse model that three views agree on, in scene radii.
std::vector<Eigen::Vector3f> sure_points(const Reconstruction& model, const SceneBall& scene) {
  constexpr std::size_t least_track = 3;
  std::vector<Eigen::Vector3f> points;
  for (const SparsePoint& point : model.points)
    if (point.track.size() >= least_track)
      points.emplace_back(((point.position - scene.center) / scene.radius).cast<float>());
  return points;
}

void add_ground(const std::vector<DepthView>& views, const std::vector<Eigen::Vector3f>& points,
                const DepthOptions& options, DenseDepth& out) {
  const auto ground = find_ground(views, out.maps, options.seed);
  if (ground)
    out.report.open = extend_over_ground(views, *ground, points,
                                         static_cast<float>(options.ground_far), out.maps);
  else
    out.report.skips.push_back({"depth of open ground and sky", ground.error().found,
                                "pixels that nothing confirms stay without depth"});
}

}  // namespace

Result<DenseDepth> dense_depth(const Reconstruction& model, const std::vector<cv::Mat>& images,
                               const DepthOptions& options, const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check(model, images));
  const int count = static_cast<int>(images.size());
  const SceneBall scene = scene_of(model);
  std::vector<DepthView> fine(images.size()), coarse(images.size());
  parallel_for(count, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const PosedView& view = model.views[k];
    fine[k] = prepare_view(images[k], view.camera, view.cam_from_world, scene.center, scene.radius,
                           options.width_px);
    coarse[k] = halved(fine[k]);
  });
  const auto neighbours = choose_neighbours(fine, options);
  DenseDepth out;
  for (const auto& some : neighbours) out.report.views_without += some.empty();
  if (out.report.views_without == count)
    return fail(ErrorKind::quality, "depth",
                "no two views look at one place from different directions",
                "record more views round the object");

  constexpr DepthRange range;
  std::vector<PlaneMap> planes(images.size());
  std::mutex reporting;
  int done = 0;
  parallel_for(count, [&](int i) {
    if (progress.cancelled()) return;
    const auto k = static_cast<std::size_t>(i);
    const auto key = options.seed * 7919u + static_cast<std::uint64_t>(i);
    PlaneMap half = random_planes(coarse[k], range, seeds_of(model, i, coarse[k], scene), key);
    improve(half, coarse[k], sources_of(coarse, k, neighbours[k]), range, options.coarse_iterations,
            options, key + 1);
    planes[k] = doubled(half, fine[k], range);
    improve(planes[k], fine[k], sources_of(fine, k, neighbours[k]), range, options.fine_iterations,
            options, key + 2);
    const std::lock_guard lock(reporting);
    progress.report({"depth", static_cast<double>(++done), static_cast<double>(count)});
  });
  ORBITFUSE_TRY(progress.check("depth"));

  out.maps = confirmed_depths(fine, planes, neighbours, options);
  double pixels = 0;
  for (std::size_t i = 0; i < out.maps.size(); ++i) {
    DepthMap& map = out.maps[i];
    pixels += static_cast<double>(map.depth.total());
    for (const float cost : planes[i].cost) out.report.matched += cost < options.max_cost;
    for (const float z : cv::Mat_<float>(map.depth)) out.report.known += std::isfinite(z);
  }
  out.report.known /= pixels;
  out.report.matched /= pixels;
  if (options.ground) add_ground(fine, sure_points(model, scene), options, out);
  for (DepthMap& map : out.maps) map.depth *= scene.radius;
  if (out.report.views_without > 0)
    out.report.skips.push_back({"depth of views without neighbours",
                                fmt::format("{} of {} views", out.report.views_without, count),
                                "they have no dense depth"});
  return out;
}

}  // namespace orbitfuse::depth
