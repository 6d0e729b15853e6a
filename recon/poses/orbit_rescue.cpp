// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/orbit_rescue.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <numbers>
#include <numeric>

#include "recon/poses/whole_view.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double supported_share = 0.72;
constexpr int min_matches = 25;
/// A restart that ends within this of the view's pose confirms it.
constexpr double same_pose_deg = 1;
/// How much better a restart must be: two places this close in score are one, seen twice.
constexpr double clearly_better = 1.02;
/// Views with less than this share of the median support are tried at other elevations.
constexpr double doubtful_share = 0.85, nudge_deg = 2;

/// Where the stations of the orbit lie, as the better half of its aligned views says.
struct LoopModel {
  double offset_deg = 0;                    ///< azimuth - nominal azimuth
  std::map<int, double> elevation_deg, radius;  ///< by loop
};

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double nominal_deg(const OrbitViews& orbit, std::size_t view) {
  const double azimuth = orbit.stations[view].azimuth_deg;
  return orbit.clockwise ? -azimuth : azimuth;
}

OrbitAngles angles_of(const OrbitViews& orbit, const Rigid3d& cam_from_world) {
  return orbit_angles(camera_center(rebase(cam_from_world, orbit.canonical_from_world)));
}

LoopModel loop_model(const OrbitViews& orbit, const RenderAlignment& alignment) {
  std::map<int, std::vector<std::size_t>> loops;
  for (std::size_t i = 0; i < orbit.stations.size(); ++i) loops[orbit.stations[i].loop].push_back(i);
  LoopModel model;
  std::vector<double> sines, cosines;
  for (auto& [loop, members] : loops) {
    std::sort(members.begin(), members.end(), [&](std::size_t a, std::size_t b) {
      return alignment.views[a].support() > alignment.views[b].support();
    });
    members.resize((members.size() + 1) / 2);
    std::vector<double> elevations, radii;
    for (const std::size_t i : members) {
      const OrbitAngles at = angles_of(orbit, alignment.views[i].view.cam_from_world);
      elevations.push_back(at.elevation_deg);
      radii.push_back(at.radius);
      const double turn = (at.azimuth_deg - nominal_deg(orbit, i)) * degree;
      sines.push_back(std::sin(turn));
      cosines.push_back(std::cos(turn));
    }
    model.elevation_deg[loop] = median_of(elevations);
    model.radius[loop] = median_of(radii);
  }
  model.offset_deg = std::atan2(median_of(sines), median_of(cosines)) / degree;
  return model;
}

/// The best supported of the nearest views on the same loop lends its orientation.
std::size_t lender(const OrbitViews& orbit, const RenderAlignment& alignment, std::size_t lost) {
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < orbit.stations.size(); ++i)
    if (i != lost && orbit.stations[i].loop == orbit.stations[lost].loop) near.push_back(i);
  if (near.empty()) return lost;
  const auto away = [&](std::size_t i) {
    return std::abs(std::remainder(nominal_deg(orbit, i) - nominal_deg(orbit, lost), 360));
  };
  std::sort(near.begin(), near.end(), [&](std::size_t a, std::size_t b) { return away(a) < away(b); });
  near.resize(std::min<std::size_t>(near.size(), 4));
  return *std::max_element(near.begin(), near.end(), [&](std::size_t a, std::size_t b) {
    return alignment.views[a].support() < alignment.views[b].support();
  });
}

using Fit = RenderAlignment;

struct Refinery {
  const SceneRenderer& renderer;
  const OrbitViews& orbit;
  const Progress& progress;

  /// The chosen views from given places, one at a time: the lens is settled.
  Result<Fit> restart(const std::vector<std::size_t>& chosen, const std::vector<PosedView>& starts,
                      std::vector<RenderRound> rounds) const {
    std::vector<cv::Mat> images;
    for (const std::size_t i : chosen) images.push_back(orbit.images[i]);
    RenderAlignmentOptions options;
    options.focal_relative_sigma = 1e-4;
    options.rounds = std::move(rounds);
    return align_with_renders(renderer, images, starts, options, progress);
  }

  /// All views from where they are, with their common lens.
  Status together(Fit& alignment, double focal_relative_sigma, std::vector<RenderRound> rounds) const {
    std::vector<PosedView> views;
    for (const RenderAlignedView& v : alignment.views) views.push_back(v.view);
    RenderAlignmentOptions options;
    options.focal_relative_sigma = focal_relative_sigma;
    options.rounds = std::move(rounds);
    ORBITFUSE_ASSIGN(alignment, align_with_renders(renderer, orbit.images, views, options, progress));
    return {};
  }
};

/// The view's place as its loop predicts it.
PosedView predicted(const OrbitViews& orbit, const Fit& alignment, const LoopModel& model, std::size_t i) {
  const int loop = orbit.stations[i].loop;
  PosedView view = alignment.views[i].view;
  const Rigid3d& like = alignment.views[lender(orbit, alignment, i)].view.cam_from_world;
  const OrbitAngles from = angles_of(orbit, like);
  view.cam_from_world = moved(like, orbit.canonical_from_world,
                              {model.offset_deg + nominal_deg(orbit, i) - from.azimuth_deg,
                               model.elevation_deg.at(loop) - from.elevation_deg,
                               std::log(model.radius.at(loop) / from.radius)});
  return view;
}

bool same_place(const OrbitViews& orbit, const Rigid3d& a, const Rigid3d& b) {
  const Eigen::Vector3d ca = camera_center(rebase(a, orbit.canonical_from_world));
  const Eigen::Vector3d cb = camera_center(rebase(b, orbit.canonical_from_world));
  return (ca - cb).norm() < same_pose_deg * degree * ca.norm() &&
         rotation_angle_deg(a.rotation, b.rotation) < same_pose_deg;
}

/// Takes what is supported better; returns those views.
std::vector<std::size_t> keep_better(const std::vector<std::size_t>& owner, const Fit& tried, Fit& alignment) {
  std::vector<std::size_t> better;
  for (std::size_t c = 0; c < owner.size(); ++c) {
    RenderAlignedView& view = alignment.views[owner[c]];
    if (tried.views[c].support() <= clearly_better * view.support()) continue;
    view = tried.views[c];
    better.push_back(owner[c]);
  }
  return better;
}

/// Of `asked`, the views that don't come back to their place from where their loop predicts them.
Result<std::vector<std::size_t>> unsettled(const Refinery& refinery, const std::vector<std::size_t>& asked,
                                           Fit& alignment) {
  const LoopModel model = loop_model(refinery.orbit, alignment);
  std::vector<PosedView> starts;
  for (const std::size_t i : asked) starts.push_back(predicted(refinery.orbit, alignment, model, i));
  ORBITFUSE_ASSIGN(const Fit tried, refinery.restart(asked, starts, {{160, 12, 10, 16}, {256, 8, 8, 12}}));
  std::vector<std::size_t> lost;
  for (std::size_t c = 0; c < asked.size(); ++c)
    if (!same_place(refinery.orbit, alignment.views[asked[c]].view.cam_from_world, tried.views[c].view.cam_from_world))
      lost.push_back(asked[c]);
  // A restart that differs gets the last round too, to be compared as equals.
  std::vector<PosedView> places;
  for (std::size_t c = 0; c < asked.size(); ++c)
    if (std::find(lost.begin(), lost.end(), asked[c]) != lost.end()) places.push_back(tried.views[c].view);
  ORBITFUSE_ASSIGN(const Fit judged, refinery.restart(lost, places, {{256, 5, 6, 10}}));
  keep_better(lost, judged, alignment);
  return lost;
}

/// Lost views searched as wholes from where their loop predicts them.
Status search_whole(const Refinery& refinery, const std::vector<std::size_t>& lost, Fit& alignment) {
  const LoopModel model = loop_model(refinery.orbit, alignment);
  std::vector<PosedView> starts;
  for (const std::size_t i : lost) {
    PosedView view = predicted(refinery.orbit, alignment, model, i);
    ORBITFUSE_TRY(climb(refinery.renderer, refinery.orbit.canonical_from_world, refinery.orbit.images[i], view, {},
                        refinery.progress));
    starts.push_back(view);
  }
  ORBITFUSE_ASSIGN(const Fit tried, refinery.restart(lost, starts, {{256, 8, 8, 12}, {256, 5, 6, 10}}));
  keep_better(lost, tried, alignment);
  return {};
}

/// Low views of a scene can settle a little too high or too low: the weaker ones are tried there,
/// again as long as that helps.
Status nudge(const Refinery& refinery, Fit& alignment) {
  std::vector<double> supports;
  for (const RenderAlignedView& v : alignment.views) supports.push_back(v.support());
  const double typical = median_of(supports);
  for (const double elevation_deg : {nudge_deg, -nudge_deg}) {
    std::vector<std::size_t> weak;
    for (std::size_t i = 0; i < supports.size(); ++i)
      if (supports[i] < doubtful_share * typical) weak.push_back(i);
    for (int pass = 0; pass < 2 && !weak.empty(); ++pass) {
      std::vector<PosedView> starts;
      for (const std::size_t i : weak) {
        starts.push_back(alignment.views[i].view);
        starts.back().cam_from_world = moved(starts.back().cam_from_world, refinery.orbit.canonical_from_world, {0, elevation_deg, 0});
      }
      ORBITFUSE_ASSIGN(const Fit tried, refinery.restart(weak, starts, fine_rounds()));
      weak = keep_better(weak, tried, alignment);
    }
  }
  return {};
}

}  // namespace

std::vector<bool> supported_views(const RenderAlignment& alignment) {
  std::vector<double> agreements;
  for (const RenderAlignedView& v : alignment.views) agreements.push_back(v.agreement);
  std::sort(agreements.begin(), agreements.end());
  const double good = agreements.empty() ? 0 : agreements[agreements.size() * 3 / 4];
  std::vector<bool> supported;
  for (const RenderAlignedView& v : alignment.views)
    supported.push_back(v.agreement >= supported_share * good && v.matches >= min_matches);
  return supported;
}

Status refine_orbit(const SceneRenderer& renderer, const OrbitViews& orbit, RenderAlignment& alignment,
                    double focal_relative_sigma, const Progress& progress) {
  const Refinery refinery{renderer, orbit, progress};
  ORBITFUSE_TRY(refinery.together(alignment, focal_relative_sigma, {{256, 8, 8, 12}, {256, 5, 6, 10}}));
  std::vector<std::size_t> lost(orbit.images.size());
  std::iota(lost.begin(), lost.end(), std::size_t{0});
  for (int pass = 0; pass < 2; ++pass) {
    ORBITFUSE_ASSIGN(lost, unsettled(refinery, lost, alignment));
    progress.report({"poses.thermal", 3, 4, -1, fmt::format("{} views don't come back to their place", lost.size())});
  }
  ORBITFUSE_TRY(search_whole(refinery, lost, alignment));
  ORBITFUSE_TRY(refinery.together(alignment, focal_relative_sigma, fine_rounds()));
  ORBITFUSE_TRY(nudge(refinery, alignment));
  return refinery.together(alignment, focal_relative_sigma, {fine_rounds().back()});
}

}  // namespace orbitfuse
