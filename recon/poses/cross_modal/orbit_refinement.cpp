// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/orbit_refinement.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/numeric/angle_units.hpp"
#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/whole_view.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

constexpr double same_pose_deg = 1;
/// Views of a loop that say where it starts.
constexpr std::size_t min_own_offset = 3;

double nominal_deg(const OrbitViews& orbit, std::size_t view) {
  const double azimuth = orbit.stations[view].azimuth_deg;
  return orbit.clockwise ? -azimuth : azimuth;
}

OrbitAngles angles_of(const OrbitViews& orbit, const Rigid3d& cam_from_world) {
  return orbit_angles(camera_center(rebase(cam_from_world, orbit.canonical_from_world)));
}

/// The best supported of the nearest views on the same loop lends its orientation.
std::size_t lender(const OrbitViews& orbit, const RenderAlignment& alignment, std::size_t lost) {
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < orbit.stations.size(); ++i)
    if (i != lost && orbit.stations[i].loop == orbit.stations[lost].loop &&
        alignment.views[i].matches > 0)
      near.push_back(i);
  if (near.empty()) return lost;
  const auto away = [&](std::size_t i) {
    return std::abs(std::remainder(nominal_deg(orbit, i) - nominal_deg(orbit, lost), 360));
  };
  std::sort(near.begin(), near.end(),
            [&](std::size_t a, std::size_t b) { return away(a) < away(b); });
  near.resize(std::min<std::size_t>(near.size(), 4));
  return *std::max_element(near.begin(), near.end(), [&](std::size_t a, std::size_t b) {
    return alignment.views[a].support() < alignment.views[b].support();
  });
}

}  // namespace

std::vector<std::size_t> not_dropped(const Fit& alignment) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < alignment.views.size(); ++i)
    if (alignment.views[i].verdict.confidence != Confidence::dropped) kept.push_back(i);
  return kept;
}

LoopModel loop_model(const OrbitViews& orbit, const RenderAlignment& alignment) {
  std::map<int, std::vector<std::size_t>> loops;
  for (std::size_t i = 0; i < orbit.stations.size(); ++i)
    if (alignment.views[i].matches > 0) loops[orbit.stations[i].loop].push_back(i);
  LoopModel model;
  std::vector<double> sines, cosines;
  const auto direction_deg = [](const std::vector<double>& s, const std::vector<double>& c) {
    return std::atan2(median(s), median(c)) / radians_per_degree;
  };
  for (auto& [loop, members] : loops) {
    std::sort(members.begin(), members.end(), [&](std::size_t a, std::size_t b) {
      return alignment.views[a].support() > alignment.views[b].support();
    });
    members.resize((members.size() + 1) / 2);
    std::vector<double> elevations, radii;
    const std::size_t before = sines.size();
    for (const std::size_t i : members) {
      const OrbitAngles at = angles_of(orbit, alignment.views[i].view.cam_from_world);
      elevations.push_back(at.elevation_deg);
      radii.push_back(at.radius);
      const double turn = (at.azimuth_deg - nominal_deg(orbit, i)) * radians_per_degree;
      sines.push_back(std::sin(turn));
      cosines.push_back(std::cos(turn));
    }
    model.elevation_deg[loop] = median(elevations);
    model.radius[loop] = median(radii);
    const auto own = static_cast<std::ptrdiff_t>(before);
    if (members.size() >= min_own_offset)
      model.loop_offset_deg[loop] =
          direction_deg({sines.begin() + own, sines.end()}, {cosines.begin() + own, cosines.end()});
  }
  if (!sines.empty()) model.offset_deg = direction_deg(sines, cosines);
  return model;
}

double LoopModel::azimuth_deg(const OrbitViews& orbit, std::size_t view) const {
  const auto own = loop_offset_deg.find(orbit.stations[view].loop);
  return (own == loop_offset_deg.end() ? offset_deg : own->second) + nominal_deg(orbit, view);
}

PosedView predicted(const OrbitViews& orbit, const Fit& alignment, const LoopModel& model,
                    std::size_t i) {
  const int loop = orbit.stations[i].loop;
  PosedView view = alignment.views[i].view;
  if (!model.radius.contains(loop)) return view;
  const Rigid3d& like = alignment.views[lender(orbit, alignment, i)].view.cam_from_world;
  const OrbitAngles from = angles_of(orbit, like);
  view.cam_from_world = moved(like, orbit.canonical_from_world,
                              {model.azimuth_deg(orbit, i) - from.azimuth_deg,
                               model.elevation_deg.at(loop) - from.elevation_deg,
                               std::log(model.radius.at(loop) / from.radius)});
  return view;
}

double apart_deg(const OrbitViews& orbit, const Rigid3d& a, const Rigid3d& b) {
  const Eigen::Vector3d ca = camera_center(rebase(a, orbit.canonical_from_world));
  const Eigen::Vector3d cb = camera_center(rebase(b, orbit.canonical_from_world));
  return std::max((ca - cb).norm() / ca.norm() / radians_per_degree,
                  rotation_angle_deg(a.rotation, b.rotation));
}

bool same_place(const OrbitViews& orbit, const Rigid3d& a, const Rigid3d& b) {
  return apart_deg(orbit, a, b) < same_pose_deg;
}

Result<Fit> OrbitRefinement::restart(const std::vector<std::size_t>& chosen,
                                     const std::vector<PosedView>& starts,
                                     std::vector<RenderRound> rounds) const {
  const TraceSpan span("restart views");
  std::vector<cv::Mat> images;
  for (const std::size_t i : chosen) images.push_back(orbit.images[i]);
  RenderAlignmentOptions options;
  options.focal_relative_sigma = 0;
  options.rounds = std::move(rounds);
  return align_with_renders(renderer, images, starts, options, progress);
}

Status OrbitRefinement::together(Fit& alignment, const FocalGuess& prior,
                                 std::vector<RenderRound> rounds) const {
  const TraceSpan span("align together");
  RenderAlignmentOptions options;
  options.focal_relative_sigma = prior.relative_sigma;
  options.prior_focal_px = prior.focal_px;
  options.rounds = std::move(rounds);
  ORBITFUSE_ASSIGN(Fit aligned, align_with_renders(renderer, orbit.images, alignment.poses(),
                                                   options, progress));
  for (std::size_t i = 0; i < aligned.views.size(); ++i)
    aligned.views[i].verdict = std::move(alignment.views[i].verdict);
  alignment = std::move(aligned);
  return {};
}

Result<std::vector<PosedView>> OrbitRefinement::search(const std::vector<std::size_t>& chosen,
                                                       const Fit& alignment) const {
  const TraceSpan span("search whole views");
  const LoopModel model = loop_model(orbit, alignment);
  std::vector<PosedView> found;
  for (const std::size_t i : chosen) found.push_back(predicted(orbit, alignment, model, i));
  std::vector<Status> done(found.size());
  parallel_for(static_cast<int>(found.size()), [&](int index) {
    const auto k = static_cast<std::size_t>(index);
    const auto ascended = ascend_correlation(renderer, orbit.canonical_from_world,
                                             orbit.images[chosen[k]], found[k], {}, progress);
    if (!ascended) done[k] = tl::unexpected(ascended.error());
  });
  for (const Status& one : done) ORBITFUSE_TRY(one);
  return found;
}

}  // namespace orbitfuse
