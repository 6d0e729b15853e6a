// SPDX-License-Identifier: BSD-3-Clause
#include "tests/app/cli/session_fixture.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <optional>

#include "capture/recording/session_writer.hpp"

namespace orbitfuse {
namespace {

/// Nearest hit of a ray with the cube [-1, 1]^3: distance and the point, or nothing.
std::optional<Eigen::Vector3d> hit_cube(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  double near = 0, far = 1e9;
  for (int a = 0; a < 3; ++a) {
    double t0 = (-1 - eye[a]) / ray[a], t1 = (1 - eye[a]) / ray[a];
    if (t0 > t1) std::swap(t0, t1);
    near = std::max(near, t0);
    far = std::min(far, t1);
  }
  if (!(near < far)) return std::nullopt;
  return eye + near * ray;
}

double pattern(const Eigen::Vector3d& p) {
  return 0.5 + 0.25 * std::sin(5 * p.x() + 3 * p.y()) + 0.25 * std::sin(7 * p.z() - 4 * p.y());
}

Rigid3d look_at_origin(const Eigen::Vector3d& eye) {
  const Eigen::Vector3d z = -eye.normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d r;
  r << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(r);
  return {q, -(q * eye)};
}

cv::Mat picture(const Camera& camera, const Rigid3d& cam_from_world, Modality modality,
                double warmer_k) {
  const bool visible = modality == Modality::visible;
  cv::Mat image(camera.height, camera.width, visible ? CV_8UC3 : CV_16UC1);
  const Eigen::Vector3d eye = camera_center(cam_from_world);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray =
          cam_from_world.rotation.conjugate() * camera.ray_of({x + 0.5, y + 0.5});
      const auto hit = hit_cube(eye, ray);
      const double v = hit ? pattern(*hit) : 0.1;
      if (visible)
        image.at<cv::Vec3b>(y, x) =
            cv::Vec3b(cv::saturate_cast<uchar>(255 * v), cv::saturate_cast<uchar>(200 * v), 60);
      else
        image.at<std::uint16_t>(y, x) =
            static_cast<std::uint16_t>(29000 + 100 * warmer_k + 2000 * v);
    }
  return image;
}

void check(const Status& status) {
  if (status) return;
  std::fprintf(stderr, "fixture: %s\n", status.error().message().c_str());
  std::abort();
}

}  // namespace

void write_fixture_session(const std::filesystem::path& folder, const FixtureOptions& options) {
  auto writer = SessionWriter::create(folder);
  if (!writer) check(tl::unexpected(writer.error()));
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    const int count = modality == Modality::visible ? options.visible : options.thermal;
    if (count == 0) continue;
    DeviceInfo device;
    device.id = std::string(name(modality)) + "0";
    device.modality = modality;
    device.driver = device.model = "fixture";
    check((*writer)->add_device(device));
    for (int i = 0; i < count; ++i) {
      const double offset = modality == Modality::visible ? 0 : 11;
      const double azimuth_deg = 360.0 * i / count + offset,
                   a = azimuth_deg * std::numbers::pi / 180;
      const Camera camera = Camera::from_fov(options.width, options.height, 50);
      const Rigid3d pose = look_at_origin({5 * std::cos(a), 5 * std::sin(a), 1.5});
      Frame frame;
      frame.id = static_cast<std::uint64_t>(i + 1);
      frame.host_time_ns = 1'700'000'000'000'000'000 + 1'000'000'000LL * i;
      frame.pixels = picture(camera, pose, modality, options.warmer_k);
      if (options.stations) {
        Station station;
        station.index = i;
        station.azimuth_deg = azimuth_deg;
        station.elevation_deg = 16.7;
        frame.station = station;
      }
      if (options.known_poses) {
        frame.cam_from_world = pose;
        frame.camera = camera;
      }
      const auto record = (*writer)->append(device.id, frame);
      if (!record) check(tl::unexpected(record.error()));
    }
  }
  check((*writer)->close());
}

}  // namespace orbitfuse
