// SPDX-License-Identifier: BSD-3-Clause
#include "bench/poses/perturbation.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"

namespace orbitfuse::scenes {
namespace {

constexpr std::uint64_t spoilt_every = 24, constant_at = 3, blind_at = 17;

bool changes_images(const Perturbation& by) {
  return by.spoilt || by.noise_k > 0 || by.blur_px > 0 || by.width_px > 0 || by.gray_gain ||
         by.radial != 0 || by.roll_deg != 0;
}

/// Each image stretched between its own 1 and 99 per cent, as a camera without radiometry does.
cv::Mat gray_of(const cv::Mat& kelvin) {
  std::vector<float> values(kelvin.begin<float>(), kelvin.end<float>());
  std::sort(values.begin(), values.end());
  const auto low = static_cast<double>(values[values.size() / 100]);
  const auto high = static_cast<double>(values[values.size() - 1 - values.size() / 100]);
  cv::Mat gray;
  kelvin.convertTo(gray, CV_8U, 255 / std::max(high - low, 1e-3),
                   -255 * low / std::max(high - low, 1e-3));
  return gray;
}

/// What a camera rolled clockwise by `deg` shows, without the corners that nobody recorded: its
/// lens is that much longer.
cv::Mat rolled(const cv::Mat& kelvin, double deg, double zoom, PosedView& truth) {
  const double angle = deg * std::numbers::pi / 180;
  const cv::Matx23d from_rolled(std::cos(angle) / zoom, -std::sin(angle) / zoom, 0,
                                std::sin(angle) / zoom, std::cos(angle) / zoom, 0);
  const Eigen::Vector2d middle(truth.camera.cx - 0.5, truth.camera.cy - 0.5);
  cv::Matx23d map = from_rolled;
  map(0, 2) = middle.x() - map(0, 0) * middle.x() - map(0, 1) * middle.y();
  map(1, 2) = middle.y() - map(1, 0) * middle.x() - map(1, 1) * middle.y();
  cv::Mat turned;
  cv::warpAffine(kelvin, turned, map, kelvin.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT, std::numeric_limits<double>::quiet_NaN());
  const Eigen::Quaterniond rolled_from_cam(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitZ()));
  truth.cam_from_world.rotation = rolled_from_cam * truth.cam_from_world.rotation;
  truth.cam_from_world.translation = rolled_from_cam * truth.cam_from_world.translation;
  truth.camera.fx *= zoom, truth.camera.fy *= zoom;
  return turned;
}

/// By which an image that is rolled so far has to grow to be without empty corners.
double zoom_of(double roll_deg, int width, int height) {
  const double angle = std::abs(roll_deg) * std::numbers::pi / 180;
  const double aspect = static_cast<double>(std::max(width, height)) / std::min(width, height);
  return std::cos(angle) + aspect * std::sin(angle);
}

Status rewrite(Scene& scene, FrameRecord& frame, const Perturbation& by, cv::RNG& random,
               const std::filesystem::path& folder) {
  ORBITFUSE_ASSIGN(cv::Mat kelvin, read_thermal_k(scene.session.path_of(frame)));
  if (by.blur_px > 0) cv::GaussianBlur(kelvin, kelvin, {}, by.blur_px);
  PosedView& truth = scene.truth.views.at(frame.file);
  if (by.width_px > 0 && by.width_px < frame.width) {
    truth.camera = truth.camera.scaled_to(by.width_px, frame.height * by.width_px / frame.width);
    cv::resize(kelvin, kelvin, {truth.camera.width, truth.camera.height}, 0, 0, cv::INTER_AREA);
  }
  if (by.radial != 0) {
    const Camera straight = truth.camera;
    truth.camera.k1 = by.radial;
    kelvin = undistorted(kelvin, straight, truth.camera);
  }
  if (by.roll_deg != 0)
    kelvin = rolled(kelvin, random.uniform(-by.roll_deg, by.roll_deg),
                    zoom_of(by.roll_deg, frame.width, frame.height), truth);
  if (by.noise_k > 0) {
    cv::Mat noise(kelvin.size(), CV_32F);
    random.fill(noise, cv::RNG::NORMAL, 0, by.noise_k);
    kelvin += noise;
  }
  if (by.spoilt && frame.sequence % spoilt_every == constant_at) kelvin.setTo(300);
  if (by.spoilt && frame.sequence % spoilt_every == blind_at)
    kelvin.setTo(std::numeric_limits<float>::quiet_NaN());
  const PosedView moved = truth;
  scene.truth.views.erase(frame.file);
  frame.file =
      (folder / fmt::format("{}_{:03}.{}", by.name, frame.sequence, by.gray_gain ? "png" : "tiff"))
          .string();
  frame.width = kelvin.cols, frame.height = kelvin.rows;
  frame.thermal_is_gray = by.gray_gain;
  scene.truth.views[frame.file] = moved;
  return by.gray_gain ? write_png(frame.file, gray_of(kelvin))
                      : write_thermal_tiff(frame.file, kelvin);
}

/// Thermal frames that were not recorded.
void leave_out(Session& session, const Perturbation& by) {
  int seen = 0, missing = 0, place = 0;
  std::erase_if(session.frames, [&](const FrameRecord& frame) {
    if (frame.modality != Modality::thermal || !frame.station) return false;
    if (by.one_loop && frame.station->loop != 0) return true;
    if (frame.station->azimuth_deg >= by.sector_deg) return true;
    if (place++ % by.keep_every != 0) return true;
    const bool chosen = ++seen % 7 == 5 && missing < by.missing_stations;
    missing += chosen ? 1 : 0;
    return chosen;
  });
}

}  // namespace

const std::vector<Perturbation>& perturbations() {
  static const std::vector<Perturbation> all = [] {
    std::vector<Perturbation> list(24);
    list[1].name = "focal+3", list[1].focal_error = 0.03;
    list[2].name = "focal-3", list[2].focal_error = -0.03;
    list[3].name = "stations5", list[3].station_error_deg = 5;
    list[4].name = "missing2", list[4].missing_stations = 2;
    list[5].name = "start77", list[5].start_deg = 77;
    list[6].name = "backwards", list[6].backwards = true;
    list[7].name = "noise100mK", list[7].noise_k = 0.1;
    list[8].name = "320px", list[8].width_px = 320;
    list[9].name = "blur2", list[9].blur_px = 2;
    list[10].name = "gray8", list[10].gray_gain = true;
    list[11].name = "order", list[11].order_alone = true;
    list[12].name = "tracking", list[12].tracking = true;
    list[13].name = "barrel", list[13].radial = -0.15;
    list[14].name = "pincushion", list[14].radial = 0.1;
    list[15].name = "half", list[15].sector_deg = 180;
    list[16].name = "loop", list[16].one_loop = true;
    list[17].name = "spoilt", list[17].spoilt = true;
    list[18].name = "nolens", list[18].focal_unknown = true;
    list[19].name = "folder", list[19].focal_unknown = list[19].order_alone = true;
    list[20].name = "third", list[20].keep_every = 3;
    list[21].name = "roll12", list[21].roll_deg = 12;
    list[22].name = "160px", list[22].width_px = 160, list[22].noise_k = 0.07;
    list[23].name = "handheld", list[23].focal_unknown = list[23].order_alone = true;
    list[23].width_px = 160, list[23].noise_k = 0.07, list[23].roll_deg = 8;
    return list;
  }();
  return all;
}

Status perturb(Scene& scene, const Perturbation& by, const std::filesystem::path& folder) {
  leave_out(scene.session, by);
  for (DeviceInfo& device : scene.session.devices) {
    if (device.modality != Modality::thermal || !device.lens.focal_px) continue;
    if (by.focal_unknown) {
      device.lens.focal_px.reset();
      continue;
    }
    *device.lens.focal_px *= 1 + by.focal_error;
    const FrameRecord* frame = scene.session.frames_of(Modality::thermal).front();
    if (by.width_px > 0 && by.width_px < frame->width)
      *device.lens.focal_px *= static_cast<double>(by.width_px) / frame->width;
    if (by.roll_deg != 0)
      *device.lens.focal_px *= zoom_of(by.roll_deg, frame->width, frame->height);
  }
  cv::RNG random(11);
  int station = 0;
  for (FrameRecord& frame : scene.session.frames) {
    if (frame.modality != Modality::thermal) continue;
    if (frame.station) {
      double& azimuth = frame.station->azimuth_deg;
      azimuth += by.start_deg + (++station % 2 == 0 ? 1 : -1) * by.station_error_deg;
      if (by.backwards) azimuth = -azimuth;
    }
    if (by.order_alone) frame.station.reset();
    if (changes_images(by)) ORBITFUSE_TRY(rewrite(scene, frame, by, random, folder));
  }
  return {};
}

}  // namespace orbitfuse::scenes
