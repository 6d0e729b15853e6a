// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/frame_readings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/geometry/lens_fold.hpp"
#include "core/numeric/bilinear.hpp"

namespace orbitfuse::measurement {
namespace {

/// Between the four samples round a pixel; NaN where one of them is. Up to the border itself the
/// outermost sample holds.
double bilinear(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  return blended(place_held<double>(image.cols, image.rows, pixel.x() - 0.5, pixel.y() - 0.5),
                 [&](int j, int i) { return static_cast<double>(image.at<float>(j, i)); });
}

bool inside(const Eigen::Vector2d& pixel, const Camera& camera) {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= camera.width &&
         pixel.y() <= camera.height;
}

/// RMS change of temperature over a step of `reach` pixels, a pixel.
double gradient_over(const cv::Mat& image, const Eigen::Vector2d& pixel, double reach) {
  double sum = 0;
  const double center = bilinear(image, pixel);
  int count = 0;
  for (const Eigen::Vector2d& step : {Eigen::Vector2d(reach, 0), Eigen::Vector2d(-reach, 0),
                                      Eigen::Vector2d(0, reach), Eigen::Vector2d(0, -reach)}) {
    const double change = bilinear(image, pixel + step) - center;
    if (!std::isfinite(change)) continue;
    sum += change * change;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) / reach : 0;
}

/// The steepest within three pose errors: an edge nearby, too, may be where the point really is.
double gradient(const cv::Mat& image, const Eigen::Vector2d& pixel, double pose_sigma_px) {
  double steepest = 0;
  for (const double reach : {1.0, 2.0, 3.0})
    steepest =
        std::max(steepest, gradient_over(image, pixel, reach * std::max(0.5, pose_sigma_px)));
  return steepest;
}

enum class Depth { same, nearer, farther };

/// What the depth map has in the direction of a point at distance z. Around edges the map's own
/// pixels straddle two surfaces, so a neighbour of the nearest one may say it.
Depth compare_depth(const cv::Mat& depth, const Eigen::Vector2d& pixel, double z,
                    double tolerance) {
  const int x = std::clamp(static_cast<int>(pixel.x()), 0, depth.cols - 1),
            y = std::clamp(static_cast<int>(pixel.y()), 0, depth.rows - 1);
  const auto d = static_cast<double>(depth.at<float>(y, x));
  if (std::abs(d - z) <= tolerance * z) return Depth::same;
  return d < z ? Depth::nearer : Depth::farther;  // NaN: nothing there at all
}

/// One frame's reading; `why` where it has none.
Result<std::optional<FrameReading>> read_frame(const ThermalScene& scene, std::size_t index,
                                               const SurfacePoint& surface,
                                               const Reradiometry& radiometry,
                                               const Progress& progress, Hidden& why) {
  const ThermalFrame& frame = scene.frames()[index];
  const MeasurementOptions& options = scene.options();
  const Eigen::Vector3d in_cam = frame.view.cam_from_world * surface.position;
  const Camera& camera = frame.view.camera;
  FrameReading reading;
  reading.frame = index;
  reading.pixel = camera.project(in_cam);
  if (!(in_cam.z() > 0)) {
    why = Hidden::behind_camera;
    return std::nullopt;
  }
  if (!reading.pixel.allFinite() || !inside(reading.pixel, camera) || !lens_holds(camera, in_cam)) {
    why = Hidden::outside_picture;
    return std::nullopt;
  }
  if (!surface.normal.isZero()) {
    const Eigen::Vector3d to_camera =
        (camera_center(frame.view.cam_from_world) - surface.position).normalized();
    const double cosine = std::clamp(to_camera.dot(surface.normal), -1.0, 1.0);
    reading.angle_deg = std::acos(cosine) * 180 / std::numbers::pi;
    if (!(reading.angle_deg <= options.max_angle_deg)) {
      why = Hidden::grazing;
      return std::nullopt;
    }
  }
  ORBITFUSE_ASSIGN(const FieldView seen, scene.seen(index, progress));
  const Camera reduced = scene.reduced_camera(index);
  const Eigen::Vector2d in_map(reading.pixel.x() * reduced.width / camera.width,
                               reading.pixel.y() * reduced.height / camera.height);
  switch (compare_depth(seen.depth, in_map, in_cam.z(), options.depth_tolerance)) {
    case Depth::nearer:
      why = Hidden::occluded;
      return std::nullopt;
    case Depth::farther:
      why = Hidden::no_surface;
      return std::nullopt;
    case Depth::same:
      break;
  }
  ORBITFUSE_ASSIGN(const cv::Mat image, scene.image(index));
  const double stored_k = bilinear(image, reading.pixel);
  reading.temperature_k = radiometry.frame_k(index, stored_k);
  if (!std::isfinite(reading.temperature_k)) {
    why = std::isfinite(stored_k) ? Hidden::impossible_parameters : Hidden::no_temperature;
    return std::nullopt;
  }
  reading.gain = radiometry.gain(index, stored_k);
  const double step_k = gradient(image, reading.pixel, options.pose_sigma_px);
  const double pose_k = step_k * options.pose_sigma_px;
  reading.gradient_k_per_px = step_k * reading.gain;
  const double cosine = std::cos(reading.angle_deg * std::numbers::pi / 180);
  reading.pixels_per_unit = cosine * std::sqrt(camera.fx * camera.fy) / in_cam.z();
  reading.weight = cosine * (frame.doubtful() ? options.doubtful_weight : 1) /
                   (options.noise_sigma_k * options.noise_sigma_k +
                    options.common_sigma_k * options.common_sigma_k + pose_k * pose_k);
  return reading;
}

}  // namespace

std::string PointReadings::why_hidden() const {
  constexpr const char* words[hidden_kinds] = {
      "have it behind them",
      "outside of their picture",
      "too flat to the surface",
      "occluded",
      "no surface of the field there",
      "no temperature there",
      "no temperature by the object parameters asked for (surroundings alone would be as bright)"};
  std::string text;
  for (std::size_t i = 0; i < hidden_kinds; ++i)
    if (hidden[i] > 0)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", hidden[i], words[i]);
  return text;
}

Result<PointReadings> read_frames(const ThermalScene& scene, const SurfacePoint& surface,
                                  const Reradiometry& radiometry, const Progress& progress) {
  PointReadings readings;
  double sum = 0;
  for (std::size_t i = 0; i < scene.frames().size(); ++i) {
    Hidden why{};
    ORBITFUSE_ASSIGN(const std::optional<FrameReading> reading,
                     read_frame(scene, i, surface, radiometry, progress, why));
    if (!reading) {
      ++readings.hidden[static_cast<std::size_t>(why)];
    } else if (reading->weight > 0) {
      readings.frames.push_back(*reading);
      sum += reading->weight;
    }
  }
  for (FrameReading& reading : readings.frames) reading.weight /= sum;
  return readings;
}

}  // namespace orbitfuse::measurement
