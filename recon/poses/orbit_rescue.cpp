// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/orbit_rescue.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace orbitfuse {
namespace {

constexpr double supported_share = 0.72;
constexpr int min_matches = 25;
constexpr int passes = 3;

double station_step_deg(const OrbitViews& orbit, std::size_t from, std::size_t to) {
  const double step = std::remainder(orbit.stations[to].azimuth_deg - orbit.stations[from].azimuth_deg, 360);
  return orbit.clockwise ? -step : step;
}

/// Supported views to start a lost one from: the nearest on its loop to both sides, then others.
std::vector<std::size_t> neighbours(const OrbitViews& orbit, const std::vector<bool>& supported, std::size_t lost) {
  std::vector<std::size_t> list;
  for (std::size_t i = 0; i < supported.size(); ++i)
    if (supported[i] && orbit.stations[i].loop == orbit.stations[lost].loop) list.push_back(i);
  std::sort(list.begin(), list.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(station_step_deg(orbit, a, lost)) < std::abs(station_step_deg(orbit, b, lost));
  });
  if (list.size() > 2) list.resize(2);
  return list;
}

}  // namespace

Rigid3d turned(const Rigid3d& cam_from_world, const Similarity3d& canonical_from_world, double degrees) {
  const Rigid3d cam_from_canonical = rebase(cam_from_world, canonical_from_world);
  const Rigid3d turn{Eigen::Quaterniond(Eigen::AngleAxisd(-degrees * 3.14159265358979323846 / 180, Eigen::Vector3d::UnitZ())),
                     Eigen::Vector3d::Zero()};
  return rebase(cam_from_canonical * turn, canonical_from_world.inverse());
}

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

Status rescue_views(const SceneRenderer& renderer, const OrbitViews& orbit, RenderAlignment& alignment,
                    const Progress& progress) {
  for (int pass = 0; pass < passes; ++pass) {
    const std::vector<bool> supported = supported_views(alignment);
    std::vector<cv::Mat> images;
    std::vector<PosedView> candidates;
    std::vector<std::size_t> owner;
    for (std::size_t i = 0; i < supported.size(); ++i) {
      if (supported[i]) continue;
      for (const std::size_t from : neighbours(orbit, supported, i))
        for (const double tweak_deg : {-6.0, 0.0, 6.0}) {
          PosedView view = alignment.views[i].view;
          view.camera = alignment.views[from].view.camera;
          view.cam_from_world = turned(alignment.views[from].view.cam_from_world, orbit.canonical_from_world,
                                       station_step_deg(orbit, from, i) + tweak_deg);
          candidates.push_back(view);
          images.push_back(orbit.images[i]);
          owner.push_back(i);
        }
    }
    if (candidates.empty()) return {};
    RenderAlignmentOptions options;
    options.focal_relative_sigma = 1e-4;  // the supported views have settled it
    options.rounds.resize(2);
    ORBITFUSE_ASSIGN(const RenderAlignment tried, align_with_renders(renderer, images, candidates, options, progress));
    bool better = false;
    for (std::size_t c = 0; c < owner.size(); ++c) {
      RenderAlignedView& view = alignment.views[owner[c]];
      if (tried.views[c].agreement <= view.agreement) continue;
      const Camera lens = view.view.camera;
      view = tried.views[c];
      view.view.camera = lens;
      better = true;
    }
    if (!better) return {};
  }
  return {};
}

}  // namespace orbitfuse
