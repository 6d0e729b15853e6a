// SPDX-License-Identifier: BSD-3-Clause
#include "recon/assembly/new_views.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/geometry/level_cameras.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/geometry/nearest_to_lines.hpp"
#include "core/geometry/quarter_turn.hpp"
#include "core/numeric/angle_units.hpp"
#include "core/numeric/median.hpp"
#include "core/option_range.hpp"

namespace orbitfuse {
namespace {

/// Below this share of the circle a full orbit would show sides that no camera saw.
constexpr double orbit_span_deg = 270;

Eigen::Vector3d axis(const PosedView& view, int row) {
  return view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::Unit(row);
}

/// cam_from_world of a camera at `eye` that looks at `target`.
Rigid3d look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                const Eigen::Vector3d& up) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = z.cross(up).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(cam_from_world);
  return {q, -(q * eye)};
}

/// As if it had not been held on its side.
Camera upright_camera(const PosedView& view, const Eigen::Vector3d& up) {
  const Eigen::Vector3d up_in_cam = view.cam_from_world.rotation * up;
  const Camera camera = view.camera.without_distortion();
  if (std::abs(up_in_cam.x()) < std::abs(up_in_cam.y())) return camera;
  return upright(QuarterTurn{up_in_cam.x() < 0 ? 1 : 3}, camera);
}

NewViews along_orbit(const std::vector<PosedView>& posed, const OrbitGeometry& orbit,
                     const NewViewOptions& options) {
  const double elevation = options.elevation_deg.value_or(orbit.elevation_deg) * radians_per_degree;
  const double radius = orbit.radius * options.radius_scale;
  const Eigen::Vector3d side = orbit.up.cross(orbit.first);
  const Camera camera =
      at_width(upright_camera(posed[posed.size() / 2], orbit.up), options.width_px);
  NewViews result;
  for (int i = 0; i < options.views; ++i) {
    const double azimuth = (options.azimuth_deg + 360.0 * i / options.views) * radians_per_degree;
    const Eigen::Vector3d out =
        std::cos(elevation) * (std::cos(azimuth) * orbit.first + std::sin(azimuth) * side) +
        std::sin(elevation) * orbit.up;
    result.views.push_back({fmt::format("{:03}", i), camera,
                            look_at(orbit.center + radius * out, orbit.center, orbit.up)});
  }
  result.described = fmt::format("orbit of {} views, elevation {:.0f}°", options.views,
                                 elevation / radians_per_degree);
  return result;
}

NewViews along_path(const std::vector<PosedView>& posed, const NewViewOptions& options) {
  NewViews result;
  const Camera camera =
      at_width(posed[posed.size() / 2].camera.without_distortion(), options.width_px);
  const double last = static_cast<double>(posed.size() - 1);
  for (int i = 0; i < options.views; ++i) {
    const double t = last * (i + 0.5) / options.views;
    const auto k = std::min(static_cast<std::size_t>(t), posed.size() - 2);
    const double share = t - static_cast<double>(k);
    const Rigid3d &a = posed[k].cam_from_world, &b = posed[k + 1].cam_from_world;
    const Eigen::Quaterniond q = a.rotation.slerp(share, b.rotation);
    const Eigen::Vector3d eye = (1 - share) * camera_center(a) + share * camera_center(b);
    result.views.push_back({fmt::format("{:03}", i), camera, {q, -(q * eye)}});
  }
  result.described = fmt::format("{} views between the recorded cameras", options.views);
  return result;
}

}  // namespace

Status NewViewOptions::validate() const {
  const OptionCheck check("render");
  ORBITFUSE_TRY(check("views", views, from_to(1, 10000)));
  ORBITFUSE_TRY(check("width_px", width_px, from_to(16, 8192)));
  if (elevation_deg) ORBITFUSE_TRY(check("elevation_deg", *elevation_deg, from_to(-89, 89)));
  ORBITFUSE_TRY(check("radius_scale", radius_scale, between(0.01, 100)));
  return check("azimuth_deg", azimuth_deg, from_to(-1e6, 1e6));
}

Result<OrbitGeometry> orbit_geometry(const std::vector<PosedView>& views) {
  if (views.size() < 2)
    return fail(ErrorKind::input, "cameras", fmt::format("{} posed", views.size()),
                "an orbit needs at least two");
  NearestToLines axes;
  Eigen::Vector3d mean_up = Eigen::Vector3d::Zero();
  for (const PosedView& v : views) {
    axes.add(camera_center(v.cam_from_world), axis(v, 2));
    mean_up -= axis(v, 1);
  }
  const std::vector<Rigid3d> cameras = cameras_of(views);
  const bool on_side = held_on_side(cameras);
  if (!(axes.crossing() > 1e-6) || (!on_side && mean_up.norm() < 1e-9))
    return fail(ErrorKind::input, "cameras", "all look in one direction: their axes meet nowhere",
                "render along their path: --path path");
  OrbitGeometry orbit;
  orbit.center = axes.point();
  orbit.up = on_side ? up_direction(cameras) : mean_up.normalized();

  std::vector<double> radii, elevations, azimuths;
  for (const PosedView& v : views) {
    const Eigen::Vector3d out = camera_center(v.cam_from_world) - orbit.center;
    const double height = out.dot(orbit.up);
    const Eigen::Vector3d flat = out - height * orbit.up;
    if (azimuths.empty()) orbit.first = flat.normalized();
    radii.push_back(out.norm());
    elevations.push_back(std::atan2(height, flat.norm()) / radians_per_degree);
    azimuths.push_back(std::atan2(flat.dot(orbit.up.cross(orbit.first)), flat.dot(orbit.first)) /
                       radians_per_degree);
  }
  orbit.radius = median(radii);
  orbit.elevation_deg = median(elevations);
  std::sort(azimuths.begin(), azimuths.end());
  double largest_gap = azimuths.front() + 360 - azimuths.back();
  for (std::size_t i = 1; i < azimuths.size(); ++i)
    largest_gap = std::max(largest_gap, azimuths[i] - azimuths[i - 1]);
  orbit.azimuth_span_deg = 360 - largest_gap;
  return orbit;
}

Result<NewViews> new_views(const std::vector<PosedView>& posed, const NewViewOptions& options) {
  ORBITFUSE_TRY(options.validate());
  if (posed.size() < 2)
    return fail(ErrorKind::input, "cameras", fmt::format("{} posed", posed.size()),
                "new views need at least two");
  const auto orbit = orbit_geometry(posed);
  if (options.path == PathKind::orbit && !orbit) return tl::unexpected(orbit.error());
  const bool surround = orbit && orbit->azimuth_span_deg >= orbit_span_deg;
  if (options.path == PathKind::orbit || (options.path == PathKind::automatic && surround))
    return along_orbit(posed, *orbit, options);
  NewViews result = along_path(posed, options);
  if (options.path == PathKind::automatic)
    result.described +=
        orbit ? fmt::format(": they cover only {:.0f}° of azimuth", orbit->azimuth_span_deg)
              : ": their axes meet nowhere";
  return result;
}

}  // namespace orbitfuse
