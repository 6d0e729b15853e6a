// SPDX-License-Identifier: BSD-3-Clause
#include "app/comparison/comparison_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "app/stages/rendered_views.hpp"
#include "core/geometry/kd_tree.hpp"
#include "core/geometry/lifted.hpp"
#include "core/geometry/narrowed.hpp"
#include "core/image/image_io.hpp"
#include "core/image/undistorted.hpp"
#include "recon/surface/surface.hpp"

namespace orbitfuse::comparing {
namespace {
using comparison::SurfaceChange;

constexpr int width_px = 560;
constexpr std::size_t most_views = 4;

Camera picture_camera(const Camera& camera) {
  return narrowed_to(camera, width_px).without_distortion();
}

Result<cv::Mat> photo_of(const ComparedRuns& runs, const PosedView& posed, const Camera& camera) {
  ORBITFUSE_ASSIGN(const cv::Mat image, read_visible(runs.after.session->folder / posed.name));
  ORBITFUSE_ASSIGN(cv::Mat straight, recorded_straight(image, posed.camera, posed.name));
  cv::Mat small;
  if (straight.channels() == 1) cv::cvtColor(straight, straight, cv::COLOR_GRAY2BGR);
  cv::resize(straight, small, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  return small;
}

/// Numbers of the table at the places that the view sees.
void number_regions(const ComparedRuns& runs, const PosedView& view, const cv::Mat& depth,
                    cv::Mat& picture) {
  const auto mark = [&](const Eigen::Vector3d& place, const std::string& word, bool hidden_too) {
    const Eigen::Vector3d in_cam = view.cam_from_world * place;
    const Eigen::Vector2d pixel = view.camera.project(in_cam);
    const cv::Point at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
    if (!pixel.allFinite() || !cv::Rect(0, 0, depth.cols, depth.rows).contains(at)) return;
    constexpr double slack = 1.02;
    if (!hidden_too && in_cam.z() > slack * static_cast<double>(depth.at<float>(at))) return;
    const cv::Point corner(at.x + 5, at.y - 5);
    cv::circle(picture, at, 3, {0, 0, 0}, cv::FILLED, cv::LINE_AA);
    cv::putText(picture, word, corner, cv::FONT_HERSHEY_SIMPLEX, 0.5, {255, 255, 255}, 3,
                cv::LINE_AA);
    cv::putText(picture, word, corner, cv::FONT_HERSHEY_SIMPLEX, 0.5, {0, 0, 0}, 1, cv::LINE_AA);
  };
  int number = 0;
  for (const auto& region : runs.differences) mark(region.place, std::to_string(++number), false);
  number = 0;
  for (const auto& region : runs.came) mark(region.place, "N" + std::to_string(++number), false);
  number = 0;
  for (const auto& region : runs.gone) mark(region.place, "G" + std::to_string(++number), true);
}

cv::Mat difference_picture(const ComparedRuns& runs, const KdTree& vertices, const PosedView& view,
                           const cv::Mat& photo, double span_k) {
  const cv::Mat depth = mesh_depth(runs.after_surface.mesh, view);
  cv::Mat gray, picture;
  cv::cvtColor(photo, gray, cv::COLOR_BGR2GRAY);
  cv::cvtColor(gray, picture, cv::COLOR_GRAY2BGR);
  const Rigid3d world_from_cam = view.cam_from_world.inverse();
  constexpr double over = 0.7;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      if (!std::isfinite(depth.at<float>(y, x))) continue;
      std::size_t nearest = 0;
      double d2 = 0;
      vertices.nearest(world_from_cam * lifted(depth, view.camera, x, y), 1, &nearest, &d2);
      const bool changed = runs.change[nearest] == SurfaceChange::changed;
      if (!changed && !runs.points[nearest].known()) continue;
      auto& pixel = picture.at<cv::Vec3b>(y, x);
      const cv::Vec3b color = color_of(runs, nearest, span_k);
      // Changed geometry is hatched, so that it is told apart without colours too.
      const double share = changed && (x + y) % 8 < 4 ? 0.2 : over;
      for (int c = 0; c < 3; ++c)
        pixel[c] = cv::saturate_cast<std::uint8_t>(share * color[c] + (1 - share) * pixel[c]);
    }
  number_regions(runs, view, depth, picture);
  return picture;
}

/// Evenly over the sure visible views, in the order of their azimuth.
std::vector<const PosedView*> views_round(const view::FinishedRun& run) {
  std::vector<std::pair<double, const PosedView*>> by_azimuth;
  const Eigen::Quaterniond level =
      Eigen::Quaterniond::FromTwoVectors(run.up, Eigen::Vector3d::UnitZ());
  for (const view::RecordedView& v : run.views) {
    if (v.modality != Modality::visible || v.doubt) continue;
    const Eigen::Vector3d from = level * (camera_center(v.view.cam_from_world) - run.center);
    by_azimuth.emplace_back(std::atan2(from.y(), from.x()), &v.view);
  }
  std::sort(by_azimuth.begin(), by_azimuth.end());
  std::vector<const PosedView*> chosen;
  const std::size_t count = std::min(most_views, by_azimuth.size());
  for (std::size_t k = 0; k < count; ++k)
    chosen.push_back(by_azimuth[k * by_azimuth.size() / count].second);
  return chosen;
}

}  // namespace

cv::Mat difference_colors() {
  const cv::Vec3d cold(150, 70, 20), none(240, 240, 240), warm(30, 20, 170);
  cv::Mat colors(1, 256, CV_8UC3);
  for (int i = 0; i < 256; ++i) {
    const double share = std::abs(i - 127.5) / 127.5;
    const cv::Vec3d c = none * (1 - share) + (i < 128 ? cold : warm) * share;
    for (int k = 0; k < 3; ++k)
      colors.at<cv::Vec3b>(0, i)[k] = cv::saturate_cast<std::uint8_t>(c[k]);
  }
  return colors;
}

double difference_span_k(const ComparedRuns& runs) {
  double largest = 2 * runs.least_difference_k;
  for (const auto& region : runs.differences)
    largest = std::max(largest, std::abs(region.difference_k));
  return std::ceil(largest);
}

cv::Vec3b color_of(const ComparedRuns& runs, std::size_t vertex, double span_k) {
  static const cv::Mat colors = difference_colors();
  if (runs.change[vertex] == SurfaceChange::changed) return changed_bgr;
  const double difference = runs.difference_k(vertex);
  if (!std::isfinite(difference)) return unknown_bgr;
  const double share = std::clamp(0.5 + 0.5 * difference / span_k, 0.0, 1.0);
  return colors.at<cv::Vec3b>(0, static_cast<int>(std::lround(255 * share)));
}

Result<std::vector<ComparisonPictures>> pictures_of(const ComparedRuns& runs,
                                                    const Progress& progress) {
  const KdTree vertices(runs.after_surface.mesh.vertices.positions);
  const double span_k = difference_span_k(runs);
  std::vector<ComparisonPictures> list;
  for (const PosedView* posed : views_round(runs.after)) {
    ORBITFUSE_TRY(progress.check("compare"));
    const PosedView view{posed->name, picture_camera(posed->camera), posed->cam_from_world};
    ComparisonPictures pictures;
    pictures.view = posed->name;
    ORBITFUSE_ASSIGN(pictures.after, photo_of(runs, *posed, view.camera));
    ORBITFUSE_ASSIGN(const nerf::RenderedView seen,
                     nerf::render(runs.before.visible, view.camera,
                                  rebase(view.cam_from_world, runs.registration.before_from_after),
                                  {}, progress));
    pictures.before = stages::bgr8_of_rgb(seen.color);
    pictures.difference = difference_picture(runs, vertices, view, pictures.after, span_k);
    list.push_back(std::move(pictures));
  }
  return list;
}

}  // namespace orbitfuse::comparing
