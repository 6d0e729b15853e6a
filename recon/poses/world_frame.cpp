// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/world_frame.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/geometry/level_cameras.hpp"
#include "core/numeric/angle_units.hpp"
#include "core/numeric/median.hpp"

namespace orbitfuse {
namespace {

/// Of a station's azimuth, where its origin alone is unknown.
constexpr double nominal_sigma_deg = 8;

double wrapped_deg(double angle) { return std::remainder(angle, 360.0); }

/// Offset minimising the sum of absolute wrapped residuals; candidates are the residuals.
double robust_offset_deg(const std::vector<double>& differences) {
  double best = 0, best_cost = std::numeric_limits<double>::infinity();
  for (const double offset : differences) {
    double cost = 0;
    for (const double d : differences) cost += std::abs(wrapped_deg(d - offset));
    if (cost < best_cost) best = offset, best_cost = cost;
  }
  return best;
}

/// Of the frames with a station, counted over all loops of their modality's stations, whether one
/// was taken there or not.
std::map<std::string, int> places_in_order(const Session& session) {
  std::map<Modality, int> per_loop;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const auto frames = session.frames_of(modality, false);
    int& stations = per_loop[modality];
    for (const FrameRecord* frame : frames)
      if (frame->station) stations = std::max(stations, frame->station->index + 1);
    if (const auto spacing_deg = station_spacing_deg(frames); spacing_deg && *spacing_deg > 0)
      stations = std::max(stations, static_cast<int>(std::lround(360 / *spacing_deg)));
  }
  std::map<std::string, int> places;
  for (const FrameRecord& frame : session.frames)
    if (!frame.tracking && frame.station)
      places[frame.file] = frame.station->loop * per_loop[frame.modality] + frame.station->index;
  return places;
}

}  // namespace

bool all_have_stations(const std::vector<const FrameRecord*>& frames) {
  return std::all_of(frames.begin(), frames.end(),
                     [](const FrameRecord* f) { return tells_azimuth(f->station); });
}

bool tells_azimuth(const std::optional<Station>& station) {
  constexpr double anywhere_deg = 90;
  return station && station->azimuth_sigma_deg.value_or(0) < anywhere_deg;
}

bool have_declared_stations(const std::vector<const FrameRecord*>& frames) {
  return !frames.empty() && std::all_of(frames.begin(), frames.end(), [](const FrameRecord* f) {
    return f->station && !f->station->azimuth_sigma_deg;
  });
}

Session in_order_alone(Session session, Modality modality) {
  for (FrameRecord& frame : session.frames)
    if (frame.modality == modality && frame.station) frame.station->azimuth_sigma_deg = 180;
  return session;
}

OrbitAngles orbit_angles(const Eigen::Vector3d& center) {
  return {std::atan2(center.y(), center.x()) * degrees_per_radian,
          std::atan2(center.z(), center.head<2>().norm()) * degrees_per_radian, center.norm()};
}

Similarity3d canonical_from_world(const std::vector<PosedView>& views,
                                  const std::vector<const FrameRecord*>& frames) {
  if (views.size() < 2) return {};
  const std::vector<Rigid3d> cameras = cameras_of(views);
  Eigen::Vector3d origin = look_at_point(cameras);
  std::vector<double> distances;
  Eigen::Vector3d mean_center = Eigen::Vector3d::Zero();
  for (const PosedView& view : views)
    mean_center += camera_center(view.cam_from_world) / static_cast<double>(views.size());
  if (!origin.allFinite()) origin = mean_center;
  for (const PosedView& view : views)
    distances.push_back((camera_center(view.cam_from_world) - origin).norm());
  const double scale = median(distances);
  if (!(scale > 0)) return {};

  const Eigen::Quaterniond z_up =
      Eigen::Quaterniond::FromTwoVectors(up_direction(cameras), Eigen::Vector3d::UnitZ());
  std::vector<double> offsets;  // azimuth in z_up minus the station's
  std::map<std::string, const FrameRecord*> by_name;
  for (const FrameRecord* frame : frames) by_name[frame->file] = frame;
  double first_azimuth = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double azimuth =
        orbit_angles(z_up * (camera_center(views[i].cam_from_world) - origin)).azimuth_deg;
    if (i == 0) first_azimuth = azimuth;
    const auto found = by_name.find(views[i].name);
    if (found != by_name.end() && tells_azimuth(found->second->station))
      offsets.push_back(azimuth - found->second->station->azimuth_deg);
  }
  const double turn = offsets.size() >= 3 ? robust_offset_deg(offsets) : first_azimuth;
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(-turn / degrees_per_radian, Eigen::Vector3d::UnitZ())) *
      z_up;
  return {1.0 / scale, rotation.normalized(), -(rotation * origin) / scale};
}

void move_world(Reconstruction& model, const Similarity3d& new_from_old) {
  for (PosedView& view : model.views)
    view.cam_from_world = rebase(view.cam_from_world, new_from_old);
  for (SparsePoint& point : model.points) point.position = new_from_old * point.position;
}

std::optional<StationFit> fit_stations(const std::vector<PosedView>& views,
                                       const Session& session) {
  std::map<std::string, const FrameRecord*> by_name;
  for (const FrameRecord& frame : session.frames) by_name[frame.file] = &frame;
  const Similarity3d canonical = canonical_from_world(views, {});
  std::vector<double> azimuth, across, station, sigma;
  std::vector<std::string> names;
  for (const PosedView& view : views) {
    const auto found = by_name.find(view.name);
    if (found == by_name.end() || !tells_azimuth(found->second->station)) continue;
    const OrbitAngles angles = orbit_angles(canonical * camera_center(view.cam_from_world));
    names.push_back(view.name);
    azimuth.push_back(angles.azimuth_deg);
    across.push_back(std::cos(angles.elevation_deg / degrees_per_radian));
    station.push_back(found->second->station->azimuth_deg);
    // Without a sigma only the origin is unknown (core/session/session.hpp); it is fitted here.
    sigma.push_back(found->second->station->azimuth_sigma_deg.value_or(nominal_sigma_deg));
  }
  if (azimuth.size() < 3) return std::nullopt;
  StationFit best;
  best.median_residual_deg = std::numeric_limits<double>::infinity();
  for (const double sign : {1.0, -1.0}) {
    std::vector<double> difference, residual;
    for (std::size_t i = 0; i < azimuth.size(); ++i)
      difference.push_back(azimuth[i] - sign * station[i]);
    StationFit fit;
    fit.views = static_cast<int>(azimuth.size());
    fit.mirrored = sign < 0;
    fit.offset_deg = robust_offset_deg(difference);
    for (std::size_t i = 0; i < difference.size(); ++i) {
      residual.push_back(std::abs(wrapped_deg(difference[i] - fit.offset_deg)));
      if (residual.back() <= 20.0 + 3.0 * sigma[i]) continue;
      ++fit.outliers;
      if (residual.back() * across[i] > 45) fit.folded.push_back(names[i]);
    }
    fit.median_residual_deg = median(residual);
    fit.worst_residual_deg = *std::max_element(residual.begin(), residual.end());
    if (fit.median_residual_deg < best.median_residual_deg) best = fit;
  }
  return best;
}

std::optional<EvenSpacing> even_spacing(const std::vector<PosedView>& views,
                                        const Session& session) {
  // Spacings are tried round the usual one, for a degree of it is most of a step after a walk of
  // two loops.
  constexpr double astray_deg = 20, off_deg = 6, step_deg = 0.1;
  const std::map<std::string, int> place_of = places_in_order(session);
  struct Placed {
    int place;
    double azimuth_deg;
    std::string name;
  };
  std::vector<Placed> placed;
  const Similarity3d canonical = canonical_from_world(views, {});
  for (const PosedView& view : views)
    if (const auto place = place_of.find(view.name); place != place_of.end())
      placed.push_back({place->second,
                        orbit_angles(canonical * camera_center(view.cam_from_world)).azimuth_deg,
                        view.name});
  if (placed.size() < 3) return std::nullopt;
  std::sort(placed.begin(), placed.end(),
            [](const Placed& a, const Placed& b) { return a.place < b.place; });
  std::vector<double> rates;
  for (std::size_t i = 1; i < placed.size(); ++i)
    if (const int steps = placed[i].place - placed[i - 1].place; steps > 0)
      rates.push_back(wrapped_deg(placed[i].azimuth_deg - placed[i - 1].azimuth_deg) / steps);
  if (rates.empty()) return std::nullopt;
  const double usual = median(rates);
  struct Tried {
    EvenSpacing even;
    double off = 0;  ///< summed, each at most as much as makes one astray
  };
  const auto tried = [&](double spacing_deg) {
    std::vector<double> difference;
    for (const Placed& p : placed) difference.push_back(p.azimuth_deg - spacing_deg * p.place);
    const double offset = robust_offset_deg(difference);
    Tried result{{spacing_deg, {}}, 0};
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const double residual = std::abs(wrapped_deg(difference[i] - offset));
      result.off += std::min(residual, astray_deg);
      if (residual > astray_deg) result.even.astray.push_back(placed[i].name);
    }
    return result;
  };
  Tried best = tried(usual);
  for (double spacing = usual - off_deg; spacing <= usual + off_deg; spacing += step_deg)
    if (Tried other = tried(spacing); other.off < best.off) best = std::move(other);
  // A loop that begins aside of the one before bends the slope through both, but no step.
  const double stations = std::round(360 / best.even.spacing_deg);
  if (std::isfinite(stations) && stations != 0 &&
      std::abs(360 / stations - usual) < std::abs(best.even.spacing_deg - usual))
    if (Tried closed = tried(360 / stations); closed.even.astray.size() <= best.even.astray.size())
      best = std::move(closed);
  return best.even;
}

std::optional<double> station_spacing_deg(const std::vector<const FrameRecord*>& frames) {
  for (const FrameRecord* frame : frames)
    if (frame->station && frame->station->index > 0)
      return frame->station->azimuth_deg / frame->station->index;
  return std::nullopt;
}

Session at_spacing(Session session, Modality modality, double spacing_deg) {
  const std::map<std::string, int> place_of = places_in_order(session);
  const int per_loop = std::max(1, static_cast<int>(std::lround(360 / spacing_deg)));
  for (FrameRecord& frame : session.frames) {
    const auto place = place_of.find(frame.file);
    if (frame.modality != modality || place == place_of.end()) continue;
    frame.station->loop = place->second / per_loop;
    frame.station->index = place->second % per_loop;
    frame.station->azimuth_deg = frame.station->index * spacing_deg;
  }
  return session;
}

CaptureOrder capture_order(const std::vector<PosedView>& views, const Session& session) {
  std::map<std::string, OrbitAngles> posed;
  const Similarity3d canonical = canonical_from_world(views, {});
  for (const PosedView& view : views)
    posed[view.name] = orbit_angles(canonical * camera_center(view.cam_from_world));
  std::map<std::string, std::vector<const FrameRecord*>> streams;
  for (const FrameRecord& frame : session.frames)
    if ((frame.station || frame.tracking) && posed.contains(frame.file))
      // Imported stations and tracking frames are streams of their own.
      streams[frame.device + (frame.tracking ? " tracking" : "")].push_back(&frame);
  struct Step {
    double azimuth_deg, frames;
    bool same_loop;
  };
  std::vector<Step> steps;
  for (auto& [device, frames] : streams) {
    std::stable_sort(frames.begin(), frames.end(), [](const FrameRecord* a, const FrameRecord* b) {
      return a->sequence < b->sequence;
    });
    for (std::size_t i = 1; i < frames.size(); ++i) {
      const OrbitAngles &from = posed[frames[i - 1]->file], &to = posed[frames[i]->file];
      steps.push_back(
          {wrapped_deg(to.azimuth_deg - from.azimuth_deg),
           std::max(1.0, static_cast<double>(frames[i]->sequence - frames[i - 1]->sequence)),
           std::abs(to.elevation_deg - from.elevation_deg) < 8});
    }
  }
  CaptureOrder order;
  order.steps = static_cast<int>(steps.size());
  std::vector<double> rates;
  for (const Step& s : steps) rates.push_back(s.azimuth_deg / s.frames);
  if (rates.empty()) return order;
  const double usual = median(rates);
  order.dense = std::abs(usual) < 20;
  for (const Step& s : steps) {
    if (!s.same_loop) continue;
    const double expected = usual * s.frames;  // beyond a sixth of the orbit a guess
    order.leaps += std::abs(expected) < 60 && std::abs(wrapped_deg(s.azimuth_deg - expected)) > 60;
    order.reversals += (usual >= 0 ? s.azimuth_deg : -s.azimuth_deg) < -5;
  }
  return order;
}

}  // namespace orbitfuse
