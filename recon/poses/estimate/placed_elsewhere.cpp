// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/placed_elsewhere.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/geometry/scene_ball.hpp"
#include "core/system/parallel.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/sfm/resection.hpp"

namespace orbitfuse {
namespace {

double orbit_radius(const Reconstruction& model) {
  std::vector<Eigen::Vector3d> centers;
  for (const PosedView& view : model.views) centers.push_back(camera_center(view.cam_from_world));
  return rms_radius(centers);
}

/// nullopt where nothing speaks against where the view stands.
std::optional<std::string> why_not_here(const OtherPlace& place, double shift,
                                        const PlacedElsewhereOptions& options) {
  const int there = place.agree_there, here = place.agree_here;
  if (shift < options.least_shift) return std::nullopt;
  if (there - here > options.more_sigmas * std::sqrt(std::max(here, 1)))
    return fmt::format(
        "the other views' points place it {:.1f} % of the orbit's radius aside, where {} of its "
        "matches agree, here {}",
        100 * shift, there, here);
  if (shift >= options.open_shift && there + std::sqrt(std::max(there, 1)) >= here)
    return fmt::format(
        "the other views' points leave its place open: {:.1f} % of the orbit's radius aside {} of "
        "its matches agree, here {}",
        100 * shift, there, here);
  return std::nullopt;
}

}  // namespace

Result<std::vector<DoubtfulView>> placed_elsewhere(const FeatureGraph& graph,
                                                   const Reconstruction& model,
                                                   const Progress& progress,
                                                   const PlacedElsewhereOptions& options) {
  const PosedFrames posed = posed_frames(graph, model);
  TrackOptions track;
  track.max_error_px *= graph.pixel_scale;
  std::vector<int> asked;
  for (int f = 0; f < graph.count(); ++f)
    if (posed.poses[at(f)]) asked.push_back(f);
  std::vector<DoubtfulView> views;
  const double radius = orbit_radius(model);
  if (asked.empty() || !(radius > 0)) return views;
  const std::vector<FeatureTrack> tracks =
      triangulate_tracks(graph, confirmed_matches(graph, posed, track.max_error_px), posed, track);
  std::vector<std::optional<OtherPlace>> places(asked.size());
  parallel_for(static_cast<int>(asked.size()), [&](int i) {
    if (progress.cancelled()) return;
    places[at(i)] = place_by_others(graph, tracks, posed, asked[at(i)], {});
  });
  ORBITFUSE_TRY(progress.check("poses.visible"));
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (!places[i]) continue;
    const double shift =
        (camera_center(places[i]->pose) - camera_center(*posed.poses[at(asked[i])])).norm() /
        radius;
    if (auto why = why_not_here(*places[i], shift, options))
      views.push_back({graph.frames[at(asked[i])]->file, DoubtReason::neighbours_elsewhere,
                       *why + "; take one between it and the next"});
  }
  return views;
}

}  // namespace orbitfuse
