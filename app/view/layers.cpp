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

std::string key_of(Modality modality, const Shot& shot, bool every_pixel) {
  const Camera& c = shot.camera;
  const Eigen::Quaterniond& q = shot.cam_from_world.rotation;
  const Eigen::Vector3d& t = shot.cam_from_world.translation;
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {}", static_cast<int>(modality),
                     every_pixel, c.width, c.height, c.fx, c.fy, c.cx, c.cy, q.w(), q.x(), q.y(),
                     q.z(), t.x(), t.y(), t.z());
}

}  // namespace

Result<LayerRenderer::Plane> LayerRenderer::rendered(Modality modality, const Shot& shot,
                                                     bool every_pixel,
                                                     RenderTurns::Job& job) const {
  const nerf::Field& field = modality == Modality::visible ? run_.visible : run_.thermal;
  const Rigid3d cam_from_field =
      modality == run_.frame ? shot.cam_from_world
                             : rebase(shot.cam_from_world, run_.frame_from_thermal.inverse());
  const int width = shot.camera.width, height = shot.camera.height;
  const int rows = std::max(least_rows, piece_pixels / width);
  cv::Mat color(height, width, modality == Modality::visible ? CV_32FC3 : CV_32FC1);
  nerf::RenderOptions quality = run_.config.render.visible;
  if (!every_pixel) quality.alike = alike;
  Plane plane;
  plane.opacity.create(height, width, CV_32FC1);
  for (int y = 0; y < height;) {
    // No sliver at the end.
    const int count = height - y < 2 * rows ? height - y : rows;
    Camera piece = shot.camera;
    piece.height = count;
    piece.cy -= y;
    ORBITFUSE_ASSIGN(const RenderTurns::Turn turn, job.turn(static_cast<double>(count) * width));
    ORBITFUSE_ASSIGN(const nerf::RenderedView seen,
                     nerf::render(field, piece, cam_from_field, quality, {}));
    seen.color.copyTo(color.rowRange(y, y + count));
    seen.opacity.copyTo(plane.opacity.rowRange(y, y + count));
    y += count;
  }
  if (modality == Modality::visible) {
    plane.image = stages::bgr8_of_rgb(color);
  } else {
    color.setTo(std::numeric_limits<float>::quiet_NaN(),
                plane.opacity < run_.config.render.min_opacity);
    plane.image = color;
  }
  return plane;
}

Result<LayerRenderer::Plane> LayerRenderer::plane(Modality modality, const Shot& shot,
                                                  bool every_pixel, RenderTurns::Job& job) {
  const std::string key = key_of(modality, shot, every_pixel);
  {
    const std::lock_guard lock(mutex_);
    const auto known = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const auto& entry) { return entry.first == key; });
    if (known != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, known);
      return kept_.front().second;
    }
  }
  ORBITFUSE_ASSIGN(const Plane made, rendered(modality, shot, every_pixel, job));
  const std::lock_guard lock(mutex_);
  kept_.emplace_front(key, made);
  std::size_t bytes = 0;
  const auto surplus = std::find_if(kept_.begin(), kept_.end(), [&](const auto& entry) {
    const Plane& p = entry.second;
    bytes += p.image.total() * p.image.elemSize() + p.opacity.total() * p.opacity.elemSize();
    return bytes > kept_bytes;
  });
  kept_.erase(surplus, kept_.end());
  return made;
}

Result<cv::Mat> LayerRenderer::fused(const Plane& visible, const Plane& thermal) const {
  const double least = run_.config.render.min_opacity;
  cv::Mat kelvin = thermal.image, opacity = thermal.opacity;
  if (kelvin.size() != visible.image.size()) {
    // NaN spreads to its neighbours: a hole grows by at most one coarse pixel.
    cv::resize(thermal.image, kelvin, visible.image.size(), 0, 0, cv::INTER_LINEAR);
    cv::resize(thermal.opacity, opacity, visible.image.size(), 0, 0, cv::INTER_LINEAR);
  }
  const cv::Mat valid = (kelvin == kelvin) & (visible.opacity >= least) & (opacity >= least);
  if (cv::countNonZero(valid) == 0) return visible.image;
  FusionOptions options = run_.config.fuse.options;
  options.method = FusionMethod::heat;
  options.heat.scale = run_.heat;
  options.span = run_.span;
  return fuse(visible.image, kelvin, valid, options);
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
    return plane(modality, sized, wish.every_pixel, job);
  };
  const int divisor = std::clamp(wish.divisor, 1, most_divisor);
  Plane visible, thermal;
  if (run_.has(Modality::visible) && (wish.visible || fuses)) {
    ORBITFUSE_ASSIGN(visible, seen_by(Modality::visible, divisor));
    if (wish.visible) layers.visible = visible.image;
  }
  if (run_.has(Modality::thermal) && (wish.thermal || fuses)) {
    const int coarser = std::clamp(wish.thermal_divisor, divisor, most_divisor);
    ORBITFUSE_ASSIGN(thermal, seen_by(Modality::thermal, coarser));
    if (wish.thermal) layers.kelvin = thermal.image;
  }
  if (fuses) {
    ORBITFUSE_ASSIGN(layers.fused, fused(visible, thermal));
  }
  return layers;
}

}  // namespace orbitfuse::view
