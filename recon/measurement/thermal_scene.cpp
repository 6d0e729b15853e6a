// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/thermal_scene.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "core/geometry/lifted.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/image/undistorted.hpp"
#include "core/near_word.hpp"
#include "recon/assembly/looked_at.hpp"
#include "recon/assembly/new_views.hpp"

namespace orbitfuse::measurement {
namespace {

constexpr int window_px = 9;  // rays round a pixel that say where its surface is and how it lies
constexpr int window_reach = 3;
constexpr int window_of_width = 640;  // those rays are a pixel apart in a picture this wide
/// Depths round a pixel that differ more than this are of another surface.
constexpr double same_surface = 0.03;

Status check_parts(const SceneParts& parts) {
  if (!parts.field || !parts.read_frame)
    return fail(ErrorKind::input, "measurement scene", "no thermal field",
                "run the session until train_thermal is done");
  if (parts.frames.empty())
    return fail(ErrorKind::input, "measurement scene", "no posed thermal frames",
                "run the session until poses_thermal is done");
  for (const ThermalFrame& frame : parts.frames) {
    ORBITFUSE_TRY(frame.view.camera.validate(frame.view.name));
    if (!frame.view.cam_from_world.is_finite())
      return fail(ErrorKind::input, frame.view.name, "its pose is not finite",
                  "run the poses stage again (--force)");
  }
  if (parts.metres_per_unit &&
      !(*parts.metres_per_unit > 0 && std::isfinite(*parts.metres_per_unit)))
    return fail(ErrorKind::input, "scale", fmt::format("{} m a unit", *parts.metres_per_unit),
                "give a length above 0");
  if (!(parts.scale_relative_sigma >= 0 && std::isfinite(parts.scale_relative_sigma)))
    return fail(ErrorKind::input, "scale",
                fmt::format("uncertain by a share of {}", parts.scale_relative_sigma),
                "must be 0 or above");
  return {};
}

/// The names that differ least from the one that was asked for.
std::string alike(const std::string& name, const std::vector<std::string>& known) {
  std::vector<std::string> list = known;
  const auto distance = [&](const std::string& word) { return edit_distance(word, name); };
  std::stable_sort(list.begin(), list.end(), [&](const std::string& a, const std::string& b) {
    return distance(a) < distance(b);
  });
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, list.size()); ++i)
    text += (i == 0 ? "" : ", ") + list[i];
  return text;
}

}  // namespace

double variation_at(const cv::Mat& temperature_k, int x, int y, int reach) {
  const auto center = static_cast<double>(temperature_k.at<float>(y, x));
  double sum = 0;
  int count = 0;
  for (int j = std::max(0, y - reach); j <= std::min(temperature_k.rows - 1, y + reach); ++j)
    for (int i = std::max(0, x - reach); i <= std::min(temperature_k.cols - 1, x + reach); ++i) {
      const double change = static_cast<double>(temperature_k.at<float>(j, i)) - center;
      if (!std::isfinite(change)) continue;
      sum += change * change;
      ++count;
    }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

struct ThermalScene::Cached {
  std::mutex making_image, making_view;
  cv::Mat image;
  std::optional<FieldView> view;
};

std::optional<Eigen::Vector3d> normal_at(const cv::Mat& depth, const Camera& camera, int x, int y,
                                         int reach) {
  const auto z0 = static_cast<double>(depth.at<float>(y, x));
  if (!(z0 > 0)) return std::nullopt;
  std::vector<Eigen::Vector3d> points;
  for (int j = std::max(0, y - reach); j <= std::min(depth.rows - 1, y + reach); ++j)
    for (int i = std::max(0, x - reach); i <= std::min(depth.cols - 1, x + reach); ++i) {
      const auto z = static_cast<double>(depth.at<float>(j, i));
      if (!(std::abs(z - z0) <= same_surface * z0)) continue;  // also NaN
      const Eigen::Vector3d point = lifted(depth, camera, i, j);
      if (point.allFinite()) points.push_back(point);
    }
  if (points.size() < 3) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) covariance += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  // On a line: any of many planes goes through it.
  if (!(solver.eigenvalues()[1] > 1e-9 * solver.eigenvalues()[2])) return std::nullopt;
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  return normal.dot(mean) > 0 ? Eigen::Vector3d(-normal) : normal;
}

ThermalScene::ThermalScene(SceneParts parts, const MeasurementOptions& options)
    : parts_(std::move(parts)),
      options_(options),
      cached_(std::make_unique<std::vector<Cached>>(parts_.frames.size())) {
  if (const auto orbit = orbit_geometry(parts_.orbit))
    middle_ = Middle{orbit->center, orbit->radius};
  if (parts_.surface.depth) return;
  parts_.surface.depth = [field = parts_.field](const Camera& camera, const Rigid3d& cam_from_world,
                                                const Progress& progress) -> Result<cv::Mat> {
    ORBITFUSE_ASSIGN(const FieldView seen, field(camera, cam_from_world, progress));
    return seen.depth;
  };
  for (const ThermalFrame& frame : parts_.frames)
    if (!frame.doubtful()) parts_.surface.views.push_back(frame.view);
}
ThermalScene::ThermalScene(ThermalScene&&) noexcept = default;
ThermalScene& ThermalScene::operator=(ThermalScene&&) noexcept = default;
ThermalScene::~ThermalScene() = default;

Result<ThermalScene> ThermalScene::make(SceneParts parts, const MeasurementOptions& options) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_parts(parts));
  return ThermalScene(std::move(parts), options);
}

bool ThermalScene::is_doubtful(const std::string& view) const {
  return parts_.doubtful_views.contains(view) ||
         std::any_of(parts_.frames.begin(), parts_.frames.end(), [&](const ThermalFrame& frame) {
           return frame.doubtful() && frame.view.name == view;
         });
}

bool ThermalScene::has_view(const std::string& name) const { return view(name).has_value(); }

Result<const PosedView*> ThermalScene::view(const std::string& name) const {
  for (const ThermalFrame& frame : parts_.frames)
    if (frame.view.name == name) return &frame.view;
  for (const PosedView& view : parts_.views)
    if (view.name == name) return &view;
  std::vector<std::string> known;
  for (const ThermalFrame& frame : parts_.frames) known.push_back(frame.view.name);
  for (const PosedView& view : parts_.views) known.push_back(view.name);
  if (std::find(parts_.unposed.begin(), parts_.unposed.end(), name) != parts_.unposed.end())
    return fail(ErrorKind::input, "view " + name,
                "a frame of the session that this run has found no pose for: nothing relates its "
                "pixels to the scene",
                "choose a posed view that shows the place, e.g. " + alike(name, known) +
                    ", or give the place as --point; the run's report says why it has no pose");
  if (std::find(parts_.outdated.begin(), parts_.outdated.end(), name) != parts_.outdated.end())
    return fail(ErrorKind::input, "view " + name, "rendered before poses or fields were made anew",
                "bring the run up to date: orbitfuse run; or choose a posed view, e.g. " +
                    alike(name, known));
  return fail(ErrorKind::input, "view " + name, "no view of this run has that name",
              "name a rendered or a posed view, e.g. " + alike(name, known));
}

Result<cv::Mat> ThermalScene::image(std::size_t frame) const {
  Cached& cached = (*cached_)[frame];
  const std::lock_guard lock(cached.making_image);
  if (!cached.image.empty()) return cached.image;
  const ThermalFrame& of = parts_.frames[frame];
  ORBITFUSE_ASSIGN(const cv::Mat image, parts_.read_frame(of));
  ORBITFUSE_TRY(check_size(image, of.view.camera, of.view.name));
  if (image.type() != CV_32FC1)
    return fail(ErrorKind::input, of.view.name, "no temperatures",
                "run the session again: its frames have changed");
  cached.image = image;
  return image;
}

Camera ThermalScene::reduced_camera(std::size_t frame) const {
  return narrowed_to(parts_.frames[frame].view.camera, options_.depth_width_px);
}

Result<FieldView> ThermalScene::seen(std::size_t frame, const Progress& progress) const {
  Cached& cached = (*cached_)[frame];
  const std::lock_guard lock(cached.making_view);
  if (!cached.view) {
    ORBITFUSE_TRY(progress.check("measure"));
    ORBITFUSE_ASSIGN(
        FieldView view,
        parts_.field(reduced_camera(frame), parts_.frames[frame].view.cam_from_world, progress));
    cached.view = std::move(view);
  }
  return *cached.view;
}

Status ThermalScene::check_within(const Eigen::Vector3d& point) const {
  // Cameras whose axes meet nowhere have no surroundings.
  if (!middle_) return check_in_scene(point, point, 1);
  return check_in_scene(point, middle_->center, middle_->radius);
}

Result<Located> ThermalScene::locate(const Eigen::Vector3d& point, const Progress& progress) const {
  ORBITFUSE_TRY(check_within(point));
  constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
  return located(parts_.surface, point, middle_ ? middle_->radius : not_known, progress);
}

Result<SurfacePoint> ThermalScene::surface_at(const PosedView& view, const Eigen::Vector2d& pixel,
                                              const Progress& progress) const {
  ORBITFUSE_ASSIGN(const std::string where, pixel_words(view, pixel));
  const Camera& camera = view.camera;
  // The same rays whatever the resolution of the view; no narrower a camera than there may be.
  constexpr double narrowest = 100;  // focal lengths per width
  const double step = std::max(static_cast<double>(camera.width) / window_of_width,
                               std::max(camera.fx, camera.fy) / (narrowest * window_px));
  Camera window = camera;
  window.width = window.height = window_px;
  window.fx /= step, window.fy /= step;
  window.cx = (camera.cx - pixel.x()) / step + 0.5 * window_px;
  window.cy = (camera.cy - pixel.y()) / step + 0.5 * window_px;
  ORBITFUSE_ASSIGN(const FieldView seen, parts_.field(window, view.cam_from_world, progress));
  constexpr int middle = window_px / 2;
  const auto z = static_cast<double>(seen.depth.at<float>(middle, middle));
  if (!(z > 0) || !std::isfinite(z))
    return fail(ErrorKind::input, where, "the field has no surface there (sky, or a hole in it)",
                "choose a pixel on the object");
  const Rigid3d world_from_cam = view.cam_from_world.inverse();
  const Eigen::Vector3d in_cam = z * camera.ray_of(pixel);
  SurfacePoint point;
  point.position = world_from_cam * in_cam;
  const auto normal = normal_at(seen.depth, window, middle, middle, window_reach);
  // A thread of a surface: it faces whoever sees it.
  point.normal = world_from_cam.rotation * normal.value_or(-in_cam.normalized());
  point.field_k = static_cast<double>(seen.temperature_k.at<float>(middle, middle));
  point.variation_k = variation_at(seen.temperature_k, middle, middle, window_reach);
  return point;
}

}  // namespace orbitfuse::measurement
