// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "app/view/layers.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"
#include "fusion/heat/heat.hpp"
#include "recon/measurement/measure.hpp"

namespace orbitfuse::inspection {
namespace {
using measurement::Answer;
using measurement::FrameLine;
using measurement::Kind;
using measurement::ThermalScene;
using view::FinishedRun;
using view::RecordedView;

constexpr int view_width_px = 560;  // three of them on a page's width

const RecordedView* view_named(const FinishedRun& run, const std::string& name) {
  const auto at = std::find_if(run.views.begin(), run.views.end(),
                               [&](const RecordedView& v) { return v.view.name == name; });
  return at == run.views.end() ? nullptr : &*at;
}

Camera picture_camera(const Camera& camera) {
  return at_width(camera.without_distortion(), view_width_px);
}

/// How finely a view sees a point; 0: not at all, because it is outside or something is before it.
Result<double> fineness(const RecordedView& view, const Eigen::Vector3d& point,
                        const ThermalScene& scene, const Progress& progress) {
  const Eigen::Vector3d in_cam = view.view.cam_from_world * point;
  const Camera whole = view.view.camera.without_distortion();
  if (!(in_cam.z() > 0)) return 0;
  const Camera camera = narrowed_to(whole, scene.options().depth_width_px);
  const Eigen::Vector2d pixel = camera.project(in_cam);
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  if (!pixel.allFinite() || x < 0 || y < 0 || x >= camera.width || y >= camera.height) return 0;
  // Only what lies round the pixel is needed.
  constexpr int reach_px = 2, window_px = 2 * reach_px + 1;
  Camera window = camera;
  window.width = window.height = window_px;
  window.cx += reach_px - x;
  window.cy += reach_px - y;
  ORBITFUSE_ASSIGN(const measurement::FieldView seen,
                   scene.render(window, view.view.cam_from_world, progress));
  const auto z = static_cast<double>(seen.depth.at<float>(reach_px, reach_px));
  // NaN: the thermal field holds nothing there, so that nothing of it is before the point either.
  if (z < in_cam.z() * (1 - scene.options().depth_tolerance)) return 0;
  return whole.fx / in_cam.z();
}

/// The visible view that sees all of the points, and the least of them finest; sure poses come
/// first.
Result<const RecordedView*> visible_view_of(const std::vector<Eigen::Vector3d>& points,
                                            const FinishedRun& run, const ThermalScene& scene,
                                            const Progress& progress) {
  const RecordedView* best = nullptr;
  std::pair<bool, double> most{false, 0};
  for (const RecordedView& view : run.views) {
    if (view.modality != Modality::visible) continue;
    ORBITFUSE_TRY(progress.check("inspection"));
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& point : points) {
      ORBITFUSE_ASSIGN(const double fine, fineness(view, point, scene, progress));
      least = std::min(least, fine);
    }
    const std::pair rank{!view.doubt, least};
    if (least > 0 && rank > most) most = rank, best = &view;
  }
  return best;
}

Status add_recorded_thermal(const RecordedView& view, const Camera& camera, const FinishedRun& run,
                            const ThermalScene& scene, FindingPictures& pictures) {
  const auto& frames = scene.frames();
  const auto frame = std::find_if(frames.begin(), frames.end(),
                                  [&](const auto& f) { return f.view.name == view.view.name; });
  if (frame == frames.end()) return {};
  ORBITFUSE_ASSIGN(const cv::Mat recorded_k,
                   scene.image(static_cast<std::size_t>(frame - frames.begin())));
  const cv::Mat kelvin = undistorted(recorded_k, view.view.camera, camera);
  ORBITFUSE_ASSIGN(const cv::Mat colors, palette(run.config.render.palette));
  pictures.thermal = colorize(kelvin, run.span, colors);
  fusion::hatch_unmeasured(pictures.thermal, kelvin);
  pictures.thermal_is_hatched = cv::countNonZero(kelvin != kelvin) > 0;
  return {};
}

/// Draws on all pictures of a finding alike: white with a dark rim, to be seen on any colour.
class Marker {
 public:
  Marker(const Camera& camera, const Rigid3d& cam_from_world)
      : camera_(camera), cam_from_world_(cam_from_world) {}

  void ring(const Eigen::Vector3d& at, const std::string& label) {
    if (const auto p = pixel(at)) rings_.push_back({*p, label});
  }
  void line(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const auto a = pixel(from), b = pixel(to);
    if (a && b) lines_.push_back({*a, *b});
  }
  void draw(cv::Mat& picture) const {
    if (picture.empty()) return;
    constexpr int radius_px = 13;
    for (const auto& [color, thickness] :
         {std::pair(cv::Scalar(0, 0, 0), 5), std::pair(cv::Scalar(255, 255, 255), 2)}) {
      for (const auto& [a, b] : lines_) cv::line(picture, a, b, color, thickness, cv::LINE_AA);
      for (const auto& [at, label] : rings_) {
        cv::circle(picture, at, radius_px, color, thickness, cv::LINE_AA);
        cv::putText(picture, label, at + cv::Point(radius_px + 4, -radius_px / 2),
                    cv::FONT_HERSHEY_SIMPLEX, 0.75, color, thickness, cv::LINE_AA);
      }
    }
  }

 private:
  std::optional<cv::Point> pixel(const Eigen::Vector3d& at) const {
    const Eigen::Vector2d p = camera_.project(cam_from_world_ * at);
    const double far = 8.0 * camera_.width;  // beyond it the drawing's integers end
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > far) return std::nullopt;
    return cv::Point(static_cast<int>(std::lround(p.x() - 0.5)),
                     static_cast<int>(std::lround(p.y() - 0.5)));
  }
  Camera camera_;
  Rigid3d cam_from_world_;
  std::vector<std::pair<cv::Point, std::string>> rings_;
  std::vector<std::pair<cv::Point, cv::Point>> lines_;
};

void mark_box(const measurement::OrientedBox& box, Marker& marker) {
  const auto corner = [&](int i) {
    const Eigen::Vector3d sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    return Eigen::Vector3d(box.rotation * (0.5 * sign.cwiseProduct(box.size)) + box.center);
  };
  for (int i = 0; i < 8; ++i)
    for (const int axis : {1, 2, 4})
      if ((i & axis) == 0) marker.line(corner(i), corner(i | axis));
}

/// The outline in the world, where the run still has the view that it was drawn in. False where a
/// corner shows no surface any more.
bool mark_polygon(const measurement::Request& request, const ThermalScene& scene,
                  const Progress& progress, Marker& marker) {
  std::vector<Eigen::Vector3d> corners;
  for (const measurement::Place& place : request.places) {
    const auto surface = measurement::surface_of(scene, place, progress);
    if (!surface) return false;
    corners.push_back(surface->position);
  }
  for (std::size_t i = 0; i < corners.size(); ++i)
    marker.line(corners[i], corners[(i + 1) % corners.size()]);
  return true;
}

std::string mark(const Answer& answer, const measurement::Request& request,
                 const ThermalScene& scene, const Progress& progress, Marker& marker) {
  switch (answer.kind) {
    case Kind::hottest:
    case Kind::coldest:
      for (std::size_t i = 0; i < answer.spots.size(); ++i)
        marker.ring(answer.spots[i].position,
                    answer.spots.size() > 1 ? fmt::format("{}", i + 1) : "");
      return answer.spots.size() > 1
                 ? "rings: the places, as numbered in the table; those on "
                   "other sides of the object are drawn where they lie behind it"
                 : "ring: the place";
    case Kind::line:
    case Kind::distance: {
      const Eigen::Vector3d* last = nullptr;
      for (const auto& point : answer.profile) {
        if (point.at && last != nullptr) marker.line(*last, point.at->position);
        last = point.at ? &point.at->position : nullptr;
      }
      if (answer.profile.empty() && answer.ends.size() == 2)
        marker.line(answer.ends[0], answer.ends[1]);
      return "line: as measured";
    }
    case Kind::box:
      mark_box(request.box, marker);
      return "box: the region";
    case Kind::polygon:
      if (answer.position) marker.ring(*answer.position, "");
      return mark_polygon(request, scene, progress, marker)
                 ? "outline: the region; ring: its middle"
                 : "ring: the region's middle";
    case Kind::difference:
      for (std::size_t i = 0; i < std::min(answer.of.size(), request.of.size()); ++i) {
        const Answer& part = answer.of[i];
        const auto at = part.spots.empty() ? part.position : part.spots.front().position;
        if (at) marker.ring(*at, i == 0 ? "1" : "2");
      }
      return "1: the first, 2: the second, behind the object where this side doesn't show it";
    case Kind::spot:
      break;
  }
  if (answer.position) marker.ring(*answer.position, "");
  return "ring: the place";
}

}  // namespace

Result<FindingPictures> pictures_of(const InspectionFinding& finding, const FinishedRun& run,
                                    const ThermalScene& scene, const Progress& progress) {
  FindingPictures pictures;
  const FrameLine* best = finding.reading().best();
  const RecordedView* view = best != nullptr ? view_named(run, best->frame) : nullptr;
  pictures.thermal_view = view != nullptr;
  const Answer& answer = finding.answer;
  // The middle between a distance's ends lies on no surface.
  std::vector<Eigen::Vector3d> shown = answer.ends;
  if (shown.empty() && finding.position()) shown = {*finding.position()};
  if (view == nullptr && !shown.empty()) {
    ORBITFUSE_ASSIGN(view, visible_view_of(shown, run, scene, progress));
  }
  if (view == nullptr) return pictures;
  pictures.view = view->view.name;
  pictures.doubtful = view->doubt.has_value();
  const Camera camera = picture_camera(view->view.camera);
  const Rigid3d& pose = view->view.cam_from_world;
  view::LayerRenderer renderer(run);
  view::RenderTurns turns;
  view::RenderTurns::Job job(turns, "inspection", progress.cancel);
  ORBITFUSE_ASSIGN(view::Layers layers,
                   renderer.render({camera, pose}, {.thermal = false, .every_pixel = true}, job));
  pictures.visible = layers.visible.clone();
  if (pictures.thermal_view) {
    pictures.fused = layers.fused.clone();
    ORBITFUSE_TRY(add_recorded_thermal(*view, camera, run, scene, pictures));
  }
  Marker marker(camera, pose);
  pictures.marks = mark(answer, finding.request, scene, progress, marker);
  for (cv::Mat* picture : {&pictures.visible, &pictures.thermal, &pictures.fused})
    marker.draw(*picture);
  return pictures;
}

}  // namespace orbitfuse::inspection
