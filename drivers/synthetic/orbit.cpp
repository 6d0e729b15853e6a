// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/synthetic/orbit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/numeric/angle_units.hpp"
#include "drivers/synthetic/noise.hpp"
#include "drivers/synthetic/stations.hpp"

namespace orbitfuse {
namespace {

Status check(bool ok, const std::string& field, double value, const std::string& remedy) {
  if (ok) return {};
  return fail(ErrorKind::usage, "synthetic." + field, fmt::format("{}", value), remedy);
}

}  // namespace

Status OrbitOptions::validate() const {
  ORBITFUSE_TRY(check(width >= 16 && width <= 8192, "width", width, "must be 16 to 8192"));
  ORBITFUSE_TRY(check(height >= 16 && height <= 8192, "height", height, "must be 16 to 8192"));
  ORBITFUSE_TRY(check(horizontal_fov_deg > 1 && horizontal_fov_deg < 150, "horizontal_fov_deg",
                      horizontal_fov_deg, "must be 1 to 150"));
  ORBITFUSE_TRY(check(station_spacing_deg >= 1 && station_spacing_deg <= 180, "station_spacing_deg",
                      station_spacing_deg, "must be 1 to 180"));
  ORBITFUSE_TRY(check(!elevations_deg.empty(), "elevations_deg", 0, "give one elevation per loop"));
  for (double e : elevations_deg)
    ORBITFUSE_TRY(check(e > 0 && e < 85, "elevations_deg", e, "must be 0 to 85"));
  ORBITFUSE_TRY(check(distance_m >= 4 && distance_m <= 16, "distance_m", distance_m,
                      "must be 4 to 16 (outside the car, inside the buildings)"));
  ORBITFUSE_TRY(check(tracking_per_station >= 0 && tracking_per_station <= 100,
                      "tracking_per_station", tracking_per_station, "must be 0 to 100"));
  for (double jitter : {azimuth_jitter_deg, elevation_jitter_deg, distance_jitter, aim_jitter_deg,
                        roll_jitter_deg}) {
    ORBITFUSE_TRY(check(jitter >= 0 && jitter <= 30, "jitter", jitter, "must be 0 to 30"));
  }
  return synthetic::camera_of(*this).validate("synthetic camera");
}

Status SyntheticOptions::validate() const {
  ORBITFUSE_TRY(visible.validate());
  ORBITFUSE_TRY(thermal.validate());
  for (double d : {defects.noise_k, defects.fixed_pattern_k, defects.vignetting_k, defects.drift_k,
                   visible_noise}) {
    ORBITFUSE_TRY(check(d >= 0 && d <= 100, "defects", d, "must be 0 to 100"));
  }
  ORBITFUSE_TRY(check(samples_per_axis >= 1 && samples_per_axis <= 16, "samples_per_axis",
                      samples_per_axis, "must be 1 to 16"));
  ORBITFUSE_TRY(check(jpeg_quality >= 1 && jpeg_quality <= 100, "jpeg_quality", jpeg_quality,
                      "must be 1 to 100"));
  return check(test_views >= 0 && test_views <= 1000, "test_views", test_views,
               "must be 0 to 1000");
}

SyntheticOptions replay_orbit_options() {
  SyntheticOptions options;
  options.visible.distance_m = 5.6;
  options.visible.elevations_deg = {14, 33};
  options.visible.k1 = -0.03;
  options.visible.k2 = 0.008;
  options.thermal.width = 384;
  options.thermal.height = 288;
  options.thermal.horizontal_fov_deg = 26;
  options.thermal.distance_m = 11;
  options.thermal.elevations_deg = {11, 27};
  options.thermal.first_azimuth_deg = 17;
  options.thermal.k1 = -0.05;
  options.thermal.azimuth_jitter_deg = 2.5;
  return options;
}

namespace synthetic {
namespace {

using Eigen::Vector3d;

/// What the operator aims at: the middle of the car.
const Vector3d aim_point(-0.1, 0, 0.62);

/// A camera at the given place that looks at a point near the car, with the horizon tilted by roll.
Rigid3d look_at(const Vector3d& center, const Vector3d& target, double roll_deg) {
  const Vector3d forward = (target - center).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d world_from_cam;
  world_from_cam << right, forward.cross(right), forward;
  const Eigen::Quaterniond rotation =
      (Eigen::Quaterniond(world_from_cam) *
       Eigen::AngleAxisd(roll_deg * radians_per_degree, Vector3d::UnitZ()))
          .normalized();
  return Rigid3d{rotation, center}.inverse();
}

Vector3d on_orbit(double azimuth_deg, double elevation_deg, double distance) {
  const double a = azimuth_deg * radians_per_degree, e = elevation_deg * radians_per_degree;
  return aim_point +
         distance * Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
}

Rigid3d jittered_pose(const OrbitOptions& o, Random& random, Exposure& exposure) {
  exposure.azimuth_deg += o.azimuth_jitter_deg * random.gaussian();
  exposure.elevation_deg += o.elevation_jitter_deg * random.gaussian();
  const double distance =
      o.distance_m * (1 + std::clamp(o.distance_jitter * random.gaussian(), -0.2, 0.2));
  const Vector3d center = on_orbit(exposure.azimuth_deg, exposure.elevation_deg, distance);
  const double aim_m = distance * std::tan(o.aim_jitter_deg * radians_per_degree);
  const Vector3d target =
      aim_point + aim_m * Vector3d(random.gaussian(), random.gaussian(), 0.5 * random.gaussian());
  return look_at(center, target, o.roll_jitter_deg * random.gaussian());
}

}  // namespace

Camera camera_of(const OrbitOptions& orbit) {
  Camera c = Camera::from_fov(orbit.width, orbit.height, orbit.horizontal_fov_deg);
  c.k1 = orbit.k1;
  c.k2 = orbit.k2;
  c.p1 = orbit.p1;
  c.p2 = orbit.p2;
  return c;
}

const OrbitOptions& orbit_of(const SyntheticOptions& options, Modality modality) {
  return modality == Modality::visible ? options.visible : options.thermal;
}

std::vector<Exposure> walk(const SyntheticOptions& options, Modality modality) {
  const OrbitOptions& o = orbit_of(options, modality);
  Random random(mix(options.seed, modality == Modality::visible ? 31 : 32));
  const int per_loop = std::max(1, static_cast<int>(std::lround(360 / o.station_spacing_deg)));
  constexpr double seconds_per_station = 9;
  std::vector<Exposure> out;
  for (int loop = 0; loop < static_cast<int>(o.elevations_deg.size()); ++loop) {
    const double elevation = o.elevations_deg[static_cast<std::size_t>(loop)];
    for (int index = 0; index < per_loop; ++index) {
      for (int k = 0; k <= o.tracking_per_station; ++k) {
        const double share = static_cast<double>(k) / (o.tracking_per_station + 1);
        Exposure exposure;
        exposure.tracking = k > 0;
        exposure.azimuth_deg = o.first_azimuth_deg + (index + share) * o.station_spacing_deg;
        exposure.elevation_deg = elevation;
        exposure.nominal = {loop, index, index * o.station_spacing_deg, elevation, 180, 5};
        exposure.time_s = seconds_per_station * (loop * per_loop + index + share);
        exposure.cam_from_world = jittered_pose(o, random, exposure);
        out.push_back(exposure);
      }
    }
  }
  return out;
}

std::vector<Rigid3d> test_poses(const SyntheticOptions& options) {
  std::vector<Rigid3d> poses;
  const double low = options.visible.elevations_deg.front(),
               high = options.visible.elevations_deg.back();
  for (int i = 0; i < options.test_views; ++i) {
    // Between stations in azimuth and between loops in elevation.
    const double azimuth = 360.0 * (i + 0.37) / std::max(1, options.test_views);
    const double elevation = low + (high - low) * (i % 2 == 0 ? 0.3 : 0.7);
    poses.push_back(
        look_at(on_orbit(azimuth, elevation, 1.05 * options.visible.distance_m), aim_point, 0));
  }
  return poses;
}

Camera test_camera(const SyntheticOptions& options) {
  const double scale = static_cast<double>(options.thermal.width) / options.visible.width;
  return Camera::from_fov(options.thermal.width,
                          static_cast<int>(std::lround(options.visible.height * scale)),
                          options.visible.horizontal_fov_deg);
}

}  // namespace synthetic
}  // namespace orbitfuse
