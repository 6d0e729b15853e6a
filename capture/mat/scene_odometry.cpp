// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/scene_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "capture/guide/coverage.hpp"
#include "capture/mat/pose_sigma.hpp"
#include "core/numeric/angle_units.hpp"

namespace orbitfuse {
namespace {

constexpr int largest_side_px = 800;  // of the images that are followed: four looks a second
constexpr int most_tracks = 240;
constexpr double track_distance_px = 10;
constexpr float most_disagreement_px = 0.7f;
/// Depth from a narrower angle is mostly noise; odometry's own poses need more, for their error
/// goes into every later one.
constexpr double first_parallax_deg = 1.5, first_unsure_parallax_deg = 5, enough_parallax_deg = 15;
constexpr double landmark_error_px = 2;
constexpr std::size_t fewest_landmarks = 15;
constexpr std::size_t enough_read_landmarks = 40;
constexpr int most_misses = 8;  // two seconds at the guide's four looks
/// Beyond the drift that was measured (docs/benchmarks/capture/faults.md).
constexpr double drift_share = 0.03;

Eigen::Vector3d ray_of(cv::Point2f px, double focal_px, cv::Point2d centre) {
  return Eigen::Vector3d((px.x - centre.x) / focal_px, (px.y - centre.y) / focal_px, 1)
      .normalized();
}

/// The middle of the shortest line between two rays; nothing behind either camera.
std::optional<Eigen::Vector3d> between_rays(const Rigid3d& a_from_mat, const Eigen::Vector3d& ray_a,
                                            const Rigid3d& b_from_mat,
                                            const Eigen::Vector3d& ray_b) {
  const Eigen::Vector3d eye_a = camera_center(a_from_mat), eye_b = camera_center(b_from_mat);
  const Eigen::Vector3d u = a_from_mat.rotation.conjugate() * ray_a,
                        v = b_from_mat.rotation.conjugate() * ray_b, w = eye_a - eye_b;
  const double uv = u.dot(v), denominator = 1 - uv * uv;
  if (denominator < 1e-6) return std::nullopt;
  const double s = (uv * v.dot(w) - u.dot(w)) / denominator,
               t = (v.dot(w) - uv * u.dot(w)) / denominator;
  if (s <= 0 || t <= 0) return std::nullopt;
  return 0.5 * (eye_a + s * u + eye_b + t * v);
}

}  // namespace

SceneOdometry::View SceneOdometry::view_of(const cv::Mat& gray, double focal_px) {
  View view;
  view.scale = std::min(1.0, static_cast<double>(largest_side_px) / std::max(gray.cols, gray.rows));
  if (view.scale < 1) {
    cv::resize(gray, view.gray, {}, view.scale, view.scale, cv::INTER_AREA);
  } else {
    view.gray = gray.clone();
  }
  view.focal_px = focal_px * view.scale;
  view.centre = {0.5 * (view.gray.cols - 1), 0.5 * (view.gray.rows - 1)};
  return view;
}

bool SceneOdometry::on_mat(const Eigen::Vector3d& p) const {
  const double half = 0.55 * mat_size_m_;
  return std::abs(p.z()) < 0.05 * mat_size_m_ && std::abs(p.x()) < half && std::abs(p.y()) < half;
}

std::vector<SceneOdometry::Track> SceneOdometry::followed(const View& view) const {
  std::vector<Track> kept;
  if (tracks_.empty() || before_.gray.size() != view.gray.size()) return kept;
  std::vector<cv::Point2f> start, end, back;
  for (const Track& track : tracks_) start.push_back(track.px);
  std::vector<unsigned char> forth_good, back_good;
  cv::calcOpticalFlowPyrLK(before_.gray, view.gray, start, end, forth_good, cv::noArray(), {21, 21},
                           4);
  cv::calcOpticalFlowPyrLK(view.gray, before_.gray, end, back, back_good, cv::noArray(), {21, 21},
                           4);
  for (std::size_t i = 0; i < start.size(); ++i) {
    const cv::Point2f off = back[i] - start[i];
    if (!forth_good[i] || !back_good[i] ||
        off.dot(off) > most_disagreement_px * most_disagreement_px)
      continue;
    kept.push_back(tracks_[i]);
    kept.back().px = end[i];
  }
  return kept;
}

void SceneOdometry::settle(const View& view, std::vector<Track> tracks, const Rigid3d& cam_from_mat,
                           bool read) {
  std::vector<Track> kept;
  for (Track& track : tracks) {
    const bool sure = track.read && read;
    const Eigen::Vector3d ray = ray_of(track.px, view.focal_px, view.centre);
    const Eigen::Vector3d first = ray_of(track.first_px, view.focal_px, view.centre);
    const double parallax =
        degrees_per_radian *
        std::acos(std::clamp((track.first_cam_from_mat.rotation.conjugate() * first)
                                 .dot(cam_from_mat.rotation.conjugate() * ray),
                             -1.0, 1.0));
    // A landmark from poses that the mat gave is not spoilt by later, less sure ones.
    const bool better = !track.point_m || (sure == track.read && parallax > track.parallax_deg);
    const double fewest_deg = sure ? first_parallax_deg : first_unsure_parallax_deg;
    if (better && parallax >= fewest_deg && track.parallax_deg < enough_parallax_deg) {
      const auto point = between_rays(track.first_cam_from_mat, first, cam_from_mat, ray);
      if (!point || on_mat(*point)) continue;
      track.point_m = point;
      track.parallax_deg = parallax;
      track.read = sure;
    }
    if (track.point_m) {
      const Eigen::Vector3d seen = cam_from_mat * *track.point_m;
      if (seen.z() <= 0) continue;
      const double u = view.focal_px * seen.x() / seen.z() + view.centre.x - track.px.x,
                   v = view.focal_px * seen.y() / seen.z() + view.centre.y - track.px.y;
      if (std::hypot(u, v) > landmark_error_px) continue;
    }
    kept.push_back(std::move(track));
  }
  tracks_ = std::move(kept);
  before_ = view;
  pose_ = cam_from_mat;
  misses_ = 0;
  add_tracks(view, cam_from_mat, read);
}

/// New corners where none is followed. The mat's own are many and strong: what lies outside its
/// outline is looked for by itself.
void SceneOdometry::add_tracks(const View& view, const Rigid3d& cam_from_mat, bool read) {
  const int wanted = most_tracks - static_cast<int>(tracks_.size());
  if (wanted < most_tracks / 4) return;
  cv::Mat outside(view.gray.size(), CV_8UC1, cv::Scalar(255)),
      inside(view.gray.size(), CV_8UC1, cv::Scalar(0));
  std::vector<cv::Point> outline;
  const double half = 0.5 * mat_size_m_;
  for (const auto& [x, y] : {std::pair(-half, -half), {half, -half}, {half, half}, {-half, half}}) {
    const Eigen::Vector3d seen = cam_from_mat * Eigen::Vector3d(x, y, 0);
    if (seen.z() <= 1e-3) continue;
    outline.emplace_back(static_cast<int>(std::clamp(
                             view.focal_px * seen.x() / seen.z() + view.centre.x, -1e4, 1e4)),
                         static_cast<int>(std::clamp(
                             view.focal_px * seen.y() / seen.z() + view.centre.y, -1e4, 1e4)));
  }
  if (outline.size() == 4) {
    cv::fillConvexPoly(outside, outline, 0);
    cv::fillConvexPoly(inside, outline, 255);
  }
  for (const Track& track : tracks_) {
    for (cv::Mat* mask : {&outside, &inside})
      cv::circle(*mask, track.px, static_cast<int>(track_distance_px), 0, -1);
  }
  for (const cv::Mat* mask : {&outside, &inside}) {
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(view.gray, corners, wanted / 2, 0.01, track_distance_px, *mask);
    for (const cv::Point2f& corner : corners)
      tracks_.push_back({corner, corner, cam_from_mat, {}, 0, read});
  }
}

void SceneOdometry::remember(const cv::Mat& gray, double focal_px, const Rigid3d& cam_from_mat,
                             double sigma_deg) {
  const View view = view_of(gray, focal_px);
  std::vector<Track> tracks = followed(view);
  // What odometry found carries its drift; the mat knows better.
  std::erase_if(tracks, [](const Track& track) { return !track.read; });
  settle(view, std::move(tracks), cam_from_mat, true);
  read_sigma_deg_ = sigma_deg;
  way_deg_ = 0;
}

std::optional<SceneOdometry::Sighting> SceneOdometry::follow(const cv::Mat& gray, double focal_px) {
  if (!pose_) return std::nullopt;
  const auto lost = [this]() -> std::optional<Sighting> {
    if (++misses_ > most_misses) {
      pose_.reset();
      tracks_.clear();
    }
    return std::nullopt;
  };
  const View view = view_of(gray, focal_px);
  std::vector<Track> tracks = followed(view);
  MatCorners landmarks;
  const auto read_ones = std::count_if(
      tracks.begin(), tracks.end(), [](const Track& track) { return track.point_m && track.read; });
  // While enough are left that the mat placed, there is no drift.
  const bool only_read = read_ones >= static_cast<std::ptrdiff_t>(enough_read_landmarks);
  for (const Track& track : tracks) {
    if (!track.point_m || (only_read && !track.read)) continue;
    landmarks.mat.emplace_back(track.point_m->x(), track.point_m->y(), track.point_m->z());
    landmarks.image.emplace_back(track.px.x, track.px.y);
  }
  if (landmarks.image.size() < fewest_landmarks) return lost();
  const cv::Matx33d k(view.focal_px, 0, view.centre.x, 0, view.focal_px, view.centre.y, 0, 0, 1);
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(landmarks.mat, landmarks.image, k, cv::noArray(), rotation, translation,
                          false, 300, static_cast<float>(landmark_error_px), 0.999, inliers,
                          cv::SOLVEPNP_AP3P) ||
      inliers.size() < std::max(fewest_landmarks, landmarks.image.size() / 2)) {
    return lost();
  }
  MatCorners agreed;
  for (int i : inliers) {
    agreed.mat.push_back(landmarks.mat[static_cast<std::size_t>(i)]);
    agreed.image.push_back(landmarks.image[static_cast<std::size_t>(i)]);
  }
  cv::solvePnPRefineLM(agreed.mat, agreed.image, k, cv::noArray(), rotation, translation);
  const PoseVector pose = pose_of(rotation, translation);
  if (!pose.allFinite()) return lost();
  const Rigid3d cam_from_mat = rigid_of(pose);
  const Eigen::Vector3d from = camera_center(*pose_), to = camera_center(cam_from_mat);
  const double step_deg =
      degrees_per_radian * std::acos(std::clamp(from.normalized().dot(to.normalized()), -1.0, 1.0));
  Sighting sighting;
  sighting.cam_from_mat = cam_from_mat;
  sighting.landmarks = static_cast<int>(agreed.image.size());
  const double error_px = reprojection_rms_px(agreed, k, rotation, translation);
  sighting.error_px = error_px / view.scale;
  // The same error on the sphere is more of azimuth the higher the camera is.
  way_deg_ += step_deg;
  const double high = std::max(0.2, std::cos(angles_of(cam_from_mat)[1] / degrees_per_radian));
  sighting.sigma_deg = read_sigma_deg_ +
                       direction_sigma_deg(agreed, k, rotation, translation, error_px) +
                       drift_share * way_deg_ / high;
  settle(view, std::move(tracks), cam_from_mat, false);
  return sighting;
}

}  // namespace orbitfuse
