// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "app/stages/rendered_views.hpp"
#include "fusion/fuse/fuse.hpp"

namespace orbitfuse::view {
namespace {

/// Of one piece: a tenth of a second on two cores, after which another client may come first.
constexpr int piece_pixels = 48'000;
constexpr int least_rows = 32;  ///< below it the look ahead of nerf::render pays no more
constexpr std::size_t kept_bytes = 96u << 20;
/// Of the value range: neighbours that differ by less look alike on a screen of 256 levels.
constexpr double alike = 1.5 / 255;
/// Pixels of the picture for one that was recorded, from which on every fourth shows all there is.
constexpr double coarse_field = 1.5;

/// How many pixels of a picture one of the modality's recorded frames spans where it is finest.
double pixels_a_recorded_one(const FinishedRun& run, Modality modality, const Shot& shot) {
  double finest = 0;
  for (const RecordedView& recorded : run.views)
    if (recorded.modality == modality) finest = std::max(finest, recorded.view.camera.fx);
  const double away = (camera_center(shot.cam_from_world) - run.center).norm();
  return finest > 0 ? shot.camera.fx / finest * std::min(1.0, run.radius / away) : 1;
}

std::string key_of(Modality modality, const Shot& shot, const LayerWish& wish) {
  const Camera& c = shot.camera;
  const Eigen::Quaterniond& q = shot.cam_from_world.rotation;
  const Eigen::Vector3d& t = shot.cam_from_world.translation;
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}", static_cast<int>(modality),
                     wish.every_pixel, wish.detail, c.width, c.height, c.fx, c.fy, c.cx, c.cy,
                     q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z());
}

std::size_t bytes_of(const nerf::RenderedView& plane) {
  std::size_t bytes = 0;
  for (const cv::Mat* part : {&plane.color, &plane.depth, &plane.opacity})
    bytes += part->total() * part->elemSize();
  return bytes;
}

}  // namespace

const nerf::Field& LayerRenderer::field_of(Modality modality) const {
  return modality == Modality::visible ? run_.visible : run_.thermal;
}

Rigid3d LayerRenderer::cam_from_field(Modality modality, const Shot& shot) const {
  return modality == run_.frame ? shot.cam_from_world
                                : rebase(shot.cam_from_world, run_.frame_from_thermal.inverse());
}

Result<LayerRenderer::Plane> LayerRenderer::rendered(Modality modality, const Shot& shot,
                                                     const LayerWish& wish,
                                                     RenderTurns::Job& job) const {
  const nerf::Field& field = field_of(modality);
  const Rigid3d pose = cam_from_field(modality, shot);
  const int width = shot.camera.width, height = shot.camera.height;
  const int rows = std::max(least_rows, piece_pixels / width);
  nerf::RenderOptions quality = run_.config.render.visible;
  if (!wish.every_pixel) {
    quality.alike = alike;
    quality.between_neighbours = true;
    if (pixels_a_recorded_one(run_, modality, shot) >= coarse_field) quality.alike_px = 4;
  }
  Plane plane;
  plane.color.create(height, width, modality == Modality::visible ? CV_32FC3 : CV_32FC1);
  plane.depth.create(height, width, CV_32FC1);
  plane.opacity.create(height, width, CV_32FC1);
  for (int y = 0; y < height;) {
    // No sliver at the end.
    const int count = height - y < 2 * rows ? height - y : rows;
    Camera piece = shot.camera;
    piece.height = count;
    piece.cy -= y;
    ORBITFUSE_ASSIGN(const RenderTurns::Turn turn, job.turn(static_cast<double>(count) * width));
    ORBITFUSE_ASSIGN(const nerf::RenderedView seen, nerf::render(field, piece, pose, quality, {}));
    seen.color.copyTo(plane.color.rowRange(y, y + count));
    seen.depth.copyTo(plane.depth.rowRange(y, y + count));
    seen.opacity.copyTo(plane.opacity.rowRange(y, y + count));
    y += count;
  }
  return plane;
}

Result<LayerRenderer::Plane> LayerRenderer::detailed(Modality modality, const Shot& shot,
                                                     const LayerWish& wish, RenderTurns::Job& job) {
  LayerWish alone = wish;
  alone.detail = false;
  ORBITFUSE_ASSIGN(Plane seen, plane(modality, shot, alone, job));
  nerf::PhotoDetail& detail = details_[modality == Modality::visible ? 0 : 1];
  if (detail.empty()) return seen;
  const nerf::Field& field = field_of(modality);
  const Rigid3d pose = cam_from_field(modality, shot);
  for (bool more = true; more;) {
    ORBITFUSE_ASSIGN(const RenderTurns::Turn turn, job.turn(piece_pixels));
    const std::lock_guard lock(detail_mutex_);
    ORBITFUSE_ASSIGN(more, detail.prepare_one(field, shot.camera, pose, seen.depth, {}));
    if (more) continue;
    seen.color = seen.color.clone();  // the plane without it is kept, too
    ORBITFUSE_TRY(detail.add(field, shot.camera, pose, seen, {}));
  }
  return seen;
}

Result<LayerRenderer::Plane> LayerRenderer::plane(Modality modality, const Shot& shot,
                                                  const LayerWish& wish, RenderTurns::Job& job) {
  const std::string key = key_of(modality, shot, wish);
  {
    const std::lock_guard lock(mutex_);
    const auto known = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const auto& entry) { return entry.first == key; });
    if (known != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, known);
      return kept_.front().second;
    }
  }
  ORBITFUSE_ASSIGN(const Plane made, wish.detail ? detailed(modality, shot, wish, job)
                                                 : rendered(modality, shot, wish, job));
  const std::lock_guard lock(mutex_);
  kept_.emplace_front(key, made);
  std::size_t bytes = 0;
  const auto surplus = std::find_if(kept_.begin(), kept_.end(), [&](const auto& entry) {
    bytes += bytes_of(entry.second);
    return bytes > kept_bytes;
  });
  kept_.erase(surplus, kept_.end());
  return made;
}

cv::Mat LayerRenderer::kelvin_of(const Plane& thermal) const {
  cv::Mat kelvin = thermal.color.clone();
  kelvin.setTo(std::numeric_limits<float>::quiet_NaN(),
               thermal.opacity < run_.config.render.min_opacity);
  return kelvin;
}

Result<cv::Mat> LayerRenderer::fused(const cv::Mat& visible, const Plane& colors,
                                     const Plane& thermal) const {
  const double least = run_.config.render.min_opacity;
  cv::Mat kelvin = kelvin_of(thermal), opacity = thermal.opacity;
  if (kelvin.size() != visible.size()) {
    // NaN spreads to its neighbours: a hole grows by at most one coarse pixel.
    cv::resize(kelvin, kelvin, visible.size(), 0, 0, cv::INTER_LINEAR);
    cv::resize(thermal.opacity, opacity, visible.size(), 0, 0, cv::INTER_LINEAR);
  }
  const cv::Mat valid = (kelvin == kelvin) & (colors.opacity >= least) & (opacity >= least);
  if (cv::countNonZero(valid) == 0) return visible;
  FusionOptions options = run_.config.fuse.options;
  options.method = FusionMethod::heat;
  options.heat.scale = run_.heat;
  options.span = run_.span;
  return fuse(visible, kelvin, valid, options);
}

Result<Layers> LayerRenderer::render(const Shot& shot, const LayerWish& wish,
                                     RenderTurns::Job& job) {
  Layers layers;
  const bool both = run_.has(Modality::visible) && run_.has(Modality::thermal);
  const bool fuses = wish.fused && both;
  const auto seen_by = [&](Modality modality, int divisor) {
    Shot sized = shot;
    const auto share = [&](int px) {
      return std::max(1, static_cast<int>(std::lround(px / static_cast<double>(divisor))));
    };
    sized.camera = shot.camera.scaled_to(share(shot.camera.width), share(shot.camera.height));
    LayerWish how;
    how.every_pixel = wish.every_pixel;
    how.detail = wish.detail && run_.has_detail();
    return plane(modality, sized, how, job);
  };
  const int divisor = std::clamp(wish.divisor, 1, most_divisor);
  Plane colors, thermal;
  cv::Mat visible;
  if (run_.has(Modality::visible) && (wish.visible || fuses)) {
    ORBITFUSE_ASSIGN(colors, seen_by(Modality::visible, divisor));
    visible = stages::bgr8_of_rgb(colors.color);
    if (wish.visible) layers.visible = visible;
  }
  if (run_.has(Modality::thermal) && (wish.thermal || fuses)) {
    const int coarser = std::clamp(wish.thermal_divisor, divisor, most_divisor);
    ORBITFUSE_ASSIGN(thermal, seen_by(Modality::thermal, coarser));
    if (wish.thermal) layers.kelvin = kelvin_of(thermal);
  }
  if (fuses) {
    ORBITFUSE_ASSIGN(layers.fused, fused(visible, colors, thermal));
  }
  return layers;
}

}  // namespace orbitfuse::view
