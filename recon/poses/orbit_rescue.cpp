// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/orbit_rescue.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "recon/poses/painted_scene.hpp"
#include "recon/poses/whole_view.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

constexpr double degree = std::numbers::pi / 180;
/// A restart that ends within this of the view's pose confirms it.
constexpr double same_pose_deg = 1;
/// How much better a restart must be: two places this close in score are one, seen twice.
constexpr double clearly_better = 1.02;
/// Views with less than this share of the median support are tried at other elevations.
constexpr double doubtful_share = 0.85, nudge_deg = 2;
/// Views with less than this share are searched as wholes.
constexpr double lost_share = 0.6;
/// Of their loop's usual support among temperatures. Right places on `container` had 0.7 or more,
/// wrong ones 0.4 at most.
constexpr double found_share = 0.5;

/// Where the stations of the orbit lie, as the better half of its aligned views says.
struct LoopModel {
  double offset_deg = 0;                        ///< azimuth - nominal azimuth
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
  for (std::size_t i = 0; i < orbit.stations.size(); ++i)
    if (alignment.views[i].matches > 0) loops[orbit.stations[i].loop].push_back(i);
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
  if (!sines.empty()) model.offset_deg = std::atan2(median_of(sines), median_of(cosines)) / degree;
  return model;
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

/// To a fraction of a degree, and where places are compared.
std::vector<RenderRound> judging_rounds() { return {{256, 8, 8, 12}, {256, 5, 6, 10}}; }

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
  Status together(Fit& alignment, double focal_relative_sigma,
                  std::vector<RenderRound> rounds) const {
    std::vector<PosedView> views;
    for (const RenderAlignedView& v : alignment.views) views.push_back(v.view);
    RenderAlignmentOptions options;
    options.focal_relative_sigma = focal_relative_sigma;
    options.rounds = std::move(rounds);
    ORBITFUSE_ASSIGN(alignment,
                     align_with_renders(renderer, orbit.images, views, options, progress));
    return {};
  }
};

/// Of the first `count` views, at least one.
double median_support(const Fit& alignment, std::size_t count) {
  std::vector<double> supports;
  for (std::size_t i = 0; i < count; ++i) supports.push_back(alignment.views[i].support());
  return median_of(supports);
}

/// The view's place as its loop predicts it; where no view of the loop is posed, its own.
PosedView predicted(const OrbitViews& orbit, const Fit& alignment, const LoopModel& model,
                    std::size_t i) {
  const int loop = orbit.stations[i].loop;
  PosedView view = alignment.views[i].view;
  if (!model.radius.contains(loop)) return view;
  const Rigid3d& like = alignment.views[lender(orbit, alignment, i)].view.cam_from_world;
  const OrbitAngles from = angles_of(orbit, like);
  view.cam_from_world = moved(like, orbit.canonical_from_world,
                              {model.offset_deg + nominal_deg(orbit, i) - from.azimuth_deg,
                               model.elevation_deg.at(loop) - from.elevation_deg,
                               std::log(model.radius.at(loop) / from.radius)});
  return view;
}

/// The larger of how far two poses lie apart as seen from the orbit's centre, and their turn.
double apart_deg(const OrbitViews& orbit, const Rigid3d& a, const Rigid3d& b) {
  const Eigen::Vector3d ca = camera_center(rebase(a, orbit.canonical_from_world));
  const Eigen::Vector3d cb = camera_center(rebase(b, orbit.canonical_from_world));
  return std::max((ca - cb).norm() / ca.norm() / degree,
                  rotation_angle_deg(a.rotation, b.rotation));
}

bool same_place(const OrbitViews& orbit, const Rigid3d& a, const Rigid3d& b) {
  return apart_deg(orbit, a, b) < same_pose_deg;
}

/// Takes what is supported better; returns those views.
std::vector<std::size_t> keep_better(const std::vector<std::size_t>& owner, const Fit& tried,
                                     Fit& alignment) {
  std::vector<std::size_t> better;
  for (std::size_t c = 0; c < owner.size(); ++c) {
    RenderAlignedView& view = alignment.views[owner[c]];
    if (tried.views[c].support() <= clearly_better * view.support()) continue;
    view = tried.views[c];
    better.push_back(owner[c]);
  }
  return better;
}

/// Views that don't come back to their place from where their loop predicts them, or have little
/// support there, so that they may have come back to a wrong one.
Result<std::vector<std::size_t>> unsettled(const Refinery& refinery, Fit& alignment) {
  const LoopModel model = loop_model(refinery.orbit, alignment);
  std::vector<std::size_t> all(alignment.views.size()), lost;
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<PosedView> starts, places;
  for (const std::size_t i : all) starts.push_back(predicted(refinery.orbit, alignment, model, i));
  ORBITFUSE_ASSIGN(const Fit tried,
                   refinery.restart(all, starts, {{160, 12, 10, 16}, {256, 8, 8, 12}}));
  const double typical = median_support(alignment, all.size());
  for (const std::size_t i : all) {
    const RenderAlignedView& view = alignment.views[i];
    if (same_place(refinery.orbit, view.view.cam_from_world, tried.views[i].view.cam_from_world) &&
        view.support() > lost_share * typical)
      continue;
    lost.push_back(i);
    places.push_back(tried.views[i].view);
  }
  // Compared after the same last round.
  ORBITFUSE_ASSIGN(const Fit judged, refinery.restart(lost, places, {judging_rounds().back()}));
  keep_better(lost, judged, alignment);
  // A restart that found good support is no longer lost.
  std::erase_if(
      lost, [&](std::size_t i) { return alignment.views[i].support() > doubtful_share * typical; });
  return lost;
}

/// Lost views searched as wholes from where their loop predicts them.
Status search_whole(const Refinery& refinery, const std::vector<std::size_t>& lost,
                    Fit& alignment) {
  const LoopModel model = loop_model(refinery.orbit, alignment);
  std::vector<PosedView> starts;
  for (const std::size_t i : lost) {
    PosedView view = predicted(refinery.orbit, alignment, model, i);
    ORBITFUSE_TRY(climb(refinery.renderer, refinery.orbit.canonical_from_world,
                        refinery.orbit.images[i], view, {}, refinery.progress));
    starts.push_back(view);
  }
  ORBITFUSE_ASSIGN(const Fit tried, refinery.restart(lost, starts, judging_rounds()));
  keep_better(lost, tried, alignment);
  return {};
}

/// Low views of a scene can settle a little too high or too low: the weaker ones are tried there,
/// again as long as that helps.
Status nudge(const Refinery& refinery, std::size_t first, Fit& alignment) {
  const double typical = median_support(alignment, alignment.views.size());
  for (const double elevation_deg : {nudge_deg, -nudge_deg}) {
    std::vector<std::size_t> weak;
    for (std::size_t i = first; i < alignment.views.size(); ++i)
      if (alignment.views[i].support() < doubtful_share * typical) weak.push_back(i);
    for (int pass = 0; pass < 2 && !weak.empty(); ++pass) {
      std::vector<PosedView> starts;
      for (const std::size_t i : weak) {
        starts.push_back(alignment.views[i].view);
        starts.back().cam_from_world =
            moved(starts.back().cam_from_world, refinery.orbit.canonical_from_world,
                  {0, elevation_deg, 0});
      }
      ORBITFUSE_ASSIGN(const Fit tried, refinery.restart(weak, starts, fine_rounds()));
      weak = keep_better(weak, tried, alignment);
    }
  }
  return {};
}

/// Why the place found among the temperatures of settled views doesn't confirm the view's; empty if
/// it does.
std::string doubt(const OrbitViews& orbit, const RenderAlignedView& view,
                  const RenderAlignedView& second, double usual_support) {
  if (!(second.support() > found_share * usual_support))
    return "its edges are not found among the stations' temperatures";
  const double apart = apart_deg(orbit, view.view.cam_from_world, second.view.cam_from_world);
  if (apart < same_pose_deg) return {};
  return fmt::format("the visible scene and the stations' temperatures place it {:.1f} deg apart",
                     apart);
}

using Usual = std::map<int, double>;  // support by loop: one sees more of the scene than another

Usual usual_support(const OrbitViews& orbit, const std::vector<std::size_t>& asked,
                    const Fit& found) {
  std::map<int, std::vector<double>> supports;
  for (std::size_t c = 0; c < asked.size(); ++c)
    supports[orbit.stations[asked[c]].loop].push_back(found.views[c].support());
  Usual usual;
  for (const auto& [loop, values] : supports) usual[loop] = median_of(values);
  return usual;
}

/// Views whose place isn't confirmed by the temperatures of the settled ones. Each is given the
/// place that both agree on from there, if there is one. `usual` is filled where empty.
Result<std::vector<std::size_t>> unconfirmed(const Refinery& visible, const Refinery& painted,
                                             const std::vector<std::size_t>& asked, Usual& usual,
                                             Fit& alignment) {
  const OrbitViews& orbit = visible.orbit;
  std::vector<PosedView> starts, places;
  for (const std::size_t i : asked) starts.push_back(alignment.views[i].view);
  ORBITFUSE_ASSIGN(const Fit second, painted.restart(asked, starts, judging_rounds()));
  if (usual.empty()) usual = usual_support(orbit, asked, second);
  const auto doubt_of = [&](std::size_t view, const RenderAlignedView& by_form,
                            const RenderAlignedView& by_heat) {
    return doubt(orbit, by_form, by_heat, usual.at(orbit.stations[view].loop));
  };
  std::vector<std::size_t> doubtful, still;
  std::vector<RenderAlignedView> seconds;
  for (std::size_t c = 0; c < asked.size(); ++c) {
    RenderAlignedView& view = alignment.views[asked[c]];
    view.doubt = doubt_of(asked[c], view, second.views[c]);
    if (view.doubt.empty()) continue;
    doubtful.push_back(asked[c]);
    seconds.push_back(second.views[c]);
    places.push_back(second.views[c].view);
  }
  ORBITFUSE_ASSIGN(const Fit first, visible.restart(doubtful, places, fine_rounds()));
  for (std::size_t c = 0; c < doubtful.size(); ++c) {
    if (doubt_of(doubtful[c], first.views[c], seconds[c]).empty())
      alignment.views[doubtful[c]] = first.views[c];
    else
      still.push_back(doubtful[c]);
  }
  return still;
}

/// Every added view confirmed by what the settled ones, before `first_new`, measured; those that
/// are not are searched as wholes in it.
Status confirm(const Refinery& refinery, std::size_t first_new, Fit& alignment) {
  const OrbitViews& orbit = refinery.orbit;
  std::vector<PosedView> settled;
  std::vector<std::size_t> added;
  for (std::size_t i = 0; i < first_new; ++i) settled.push_back(alignment.views[i].view);
  for (std::size_t i = first_new; i < orbit.images.size(); ++i) added.push_back(i);
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   painted_scene(refinery.renderer, settled, orbit.images, {}, refinery.progress));
  const Refinery painted{renderer, orbit, refinery.progress};
  Usual usual;
  ORBITFUSE_ASSIGN(std::vector<std::size_t> lost,
                   unconfirmed(refinery, painted, added, usual, alignment));
  const LoopModel model = loop_model(orbit, alignment);
  std::vector<PosedView> starts;
  for (const std::size_t i : lost) {
    starts.push_back(predicted(orbit, alignment, model, i));
    ORBITFUSE_TRY(climb(renderer, orbit.canonical_from_world, orbit.images[i], starts.back(), {},
                        refinery.progress));
  }
  ORBITFUSE_ASSIGN(const Fit searched, refinery.restart(lost, starts, fine_rounds()));
  for (std::size_t c = 0; c < lost.size(); ++c) alignment.views[lost[c]] = searched.views[c];
  ORBITFUSE_ASSIGN(lost, unconfirmed(refinery, painted, lost, usual, alignment));
  refinery.progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{} of {} added views are not confirmed", lost.size(), added.size())});
  return {};
}

}  // namespace

Status refine_orbit(const SceneRenderer& renderer, const OrbitViews& orbit,
                    RenderAlignment& alignment, double focal_relative_sigma,
                    const Progress& progress) {
  const Refinery refinery{renderer, orbit, progress};
  ORBITFUSE_TRY(refinery.together(alignment, focal_relative_sigma, judging_rounds()));
  ORBITFUSE_ASSIGN(const std::vector<std::size_t> lost, unsettled(refinery, alignment));
  progress.report({"poses.thermal", 3, 4, -1,
                   fmt::format("{} views don't come back to their place", lost.size())});
  ORBITFUSE_TRY(search_whole(refinery, lost, alignment));
  ORBITFUSE_TRY(refinery.together(alignment, focal_relative_sigma, fine_rounds()));
  ORBITFUSE_TRY(nudge(refinery, 0, alignment));
  return refinery.together(alignment, focal_relative_sigma, {fine_rounds().back()});
}

double station_offset_deg(const OrbitViews& orbit, const RenderAlignment& alignment) {
  return loop_model(orbit, alignment).offset_deg;
}

Status add_views(const SceneRenderer& renderer, const OrbitViews& orbit, std::size_t first_new,
                 RenderAlignment& alignment, const Progress& progress) {
  const Refinery refinery{renderer, orbit, progress};
  const LoopModel model = loop_model(orbit, alignment);
  if (first_new == 0) return {};
  const double typical = median_support(alignment, first_new);
  std::vector<std::size_t> added, lost;
  std::vector<PosedView> starts;
  for (std::size_t i = first_new; i < orbit.images.size(); ++i) {
    added.push_back(i);
    starts.push_back(predicted(orbit, alignment, model, i));
  }
  std::vector<RenderRound> rounds = {{160, 16, 12, 18}, {160, 8, 8, 12}};
  for (const RenderRound& round : fine_rounds()) rounds.push_back(round);
  ORBITFUSE_ASSIGN(const Fit tried, refinery.restart(added, starts, rounds));
  for (std::size_t c = 0; c < added.size(); ++c) {
    alignment.views[added[c]] = tried.views[c];
    if (tried.views[c].support() < lost_share * typical) lost.push_back(added[c]);
  }
  progress.report(
      {"poses.thermal", 3, 4, -1,
       fmt::format("{} of {} added views searched as a whole", lost.size(), added.size())});
  starts.clear();
  for (const std::size_t i : lost) {
    PosedView view = predicted(orbit, alignment, model, i);
    ORBITFUSE_TRY(climb(renderer, orbit.canonical_from_world, orbit.images[i], view, {}, progress));
    starts.push_back(view);
  }
  ORBITFUSE_ASSIGN(const Fit searched, refinery.restart(lost, starts, fine_rounds()));
  keep_better(lost, searched, alignment);
  ORBITFUSE_TRY(nudge(refinery, first_new, alignment));
  return confirm(refinery, first_new, alignment);
}

}  // namespace orbitfuse
