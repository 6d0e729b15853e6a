// SPDX-License-Identifier: BSD-3-Clause
#include "app/planning/scene_facts.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/stages/given_cameras.hpp"
#include "core/image/image_io.hpp"

namespace orbitfuse::planning {
namespace {

constexpr int most_width_px = 640, coarse_width_px = 100;
constexpr std::size_t every = 4;  // neighbours show the same

double smoothness_db(const cv::Mat& photo) {
  const auto scaled = [&](const cv::Mat& from, int width, int how) {
    cv::Mat to;
    const int height = std::max(1, width * photo.rows / photo.cols);
    cv::resize(from, to, {width, height}, 0, 0, how);
    return to;
  };
  cv::Mat fine;
  // Enlarged, a small photo would look as if its scene had no detail.
  scaled(photo, std::min(most_width_px, photo.cols), cv::INTER_AREA)
      .convertTo(fine, CV_32F, 1.0 / 255);
  cv::Mat coarse = scaled(fine, coarse_width_px, cv::INTER_AREA), again;
  cv::resize(coarse, again, fine.size(), 0, 0, cv::INTER_LINEAR);
  const double rms = cv::norm(fine, again) / std::sqrt(static_cast<double>(fine.total()) *
                                                       static_cast<double>(fine.channels()));
  constexpr double least_rms = 1e-4;  // a blank wall
  return -20 * std::log10(std::max(rms, least_rms));
}

double height_by_width(const std::vector<const FrameRecord*>& frames, double otherwise) {
  return frames.empty() || frames.front()->width == 0
             ? otherwise
             : static_cast<double>(frames.front()->height) / frames.front()->width;
}

bool all_posed(const std::vector<const FrameRecord*>& frames) {
  return !frames.empty() && std::all_of(frames.begin(), frames.end(), [](const FrameRecord* frame) {
    return frame->cam_from_world.has_value();
  });
}

/// How many new views there will be, and of what size.
Status look_at_new_views(const stages::RenderConfig& config, double height_by_width,
                         SceneFacts& facts) {
  facts.detail_sources = config.detail.sources;
  facts.new_views = config.path.views;
  facts.new_view_mpx = 1e-6 * config.path.width_px * config.path.width_px * height_by_width;
  if (config.cameras.empty()) return {};
  ORBITFUSE_ASSIGN(const stages::GivenCameras given, stages::read_given_cameras(config.cameras));
  double pixels = 0;
  for (const PosedView& view : given.views.views)
    pixels += static_cast<double>(view.camera.width) * view.camera.height;
  facts.new_views = static_cast<int>(given.files.size());
  facts.new_view_mpx = 1e-6 * pixels / std::max(1, facts.new_views);
  return {};
}

}  // namespace

nlohmann::json to_json(const SceneFacts& facts) {
  return {{"visible_views", facts.visible_views},
          {"thermal_views", facts.thermal_views},
          {"visible_posed", facts.visible_posed},
          {"thermal_posed", facts.thermal_posed},
          {"visible_measured", facts.visible_measured},
          {"thermal_measured", facts.thermal_measured},
          {"visible_height_by_width", facts.visible_height_by_width},
          {"thermal_height_by_width", facts.thermal_height_by_width},
          {"depth_width_px", facts.depth_width_px},
          {"new_views", facts.new_views},
          {"new_view_mpx", facts.new_view_mpx},
          {"detail_sources", facts.detail_sources},
          {"fusion_methods", facts.fusion_methods},
          {"smoothness_db", facts.smoothness_db}};
}

Result<SceneFacts> look_at(const stages::SessionInput& input, const stages::RunConfig& config) {
  SceneFacts facts;
  const auto photos = input.session.frames_of(Modality::visible, false),
             thermal = input.session.frames_of(Modality::thermal, false);
  facts.visible_views = input.count(Modality::visible);
  facts.thermal_views = input.count(Modality::thermal);
  facts.visible_posed = config.poses.use_known_poses && all_posed(photos);
  facts.thermal_posed = config.poses.use_known_poses && all_posed(thermal);
  facts.visible_height_by_width = height_by_width(photos, facts.visible_height_by_width);
  facts.thermal_height_by_width = height_by_width(thermal, facts.thermal_height_by_width);
  facts.depth_width_px = config.depth.width_px;
  facts.visible_measured =
      facts.visible_views > 0 && config.train_visible.options.holdout_every > 0;
  facts.thermal_measured = facts.thermal_views > 0 && input.has_temperatures() &&
                           config.train_thermal.options.holdout_every > 0;
  ORBITFUSE_TRY(look_at_new_views(
      config.render, photos.empty() ? facts.thermal_height_by_width : facts.visible_height_by_width,
      facts));
  facts.fusion_methods = static_cast<int>(config.fuse.methods.size());
  double sum = 0;
  int looked_at = 0;
  for (std::size_t i = 0; i < photos.size(); i += every) {
    ORBITFUSE_ASSIGN(const cv::Mat photo, read_visible(input.session.path_of(*photos[i])));
    sum += smoothness_db(photo);
    ++looked_at;
  }
  if (looked_at > 0) facts.smoothness_db = sum / looked_at;
  return facts;
}

}  // namespace orbitfuse::planning
