// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_finder.hpp"

#include <Eigen/LU>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/mat/aruco_dictionary.hpp"
#include "capture/mat/pose_sigma.hpp"
#include "core/numeric/median.hpp"
#include "core/option_range.hpp"

namespace orbitfuse {
namespace {

/// Above what Coverage accepts: a followed position steers, it proves no station.
constexpr double followed_sigma_deg = 3;

/// 8-bit grey; thermal samples stretched between percentiles, so that one hot spot hides nothing.
cv::Mat gray_of(const cv::Mat& image) {
  cv::Mat gray;
  if (image.type() == CV_8UC3) {
    cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  } else if (image.type() == CV_8UC1) {
    gray = image;
  } else if (image.type() == CV_16UC1) {
    std::vector<std::uint16_t> samples;
    for (int y = 0; y < image.rows; y += 2) {
      for (int x = 0; x < image.cols; x += 2) {
        if (const std::uint16_t v = image.at<std::uint16_t>(y, x); v != 0) samples.push_back(v);
      }
    }
    if (samples.empty()) return {};
    const double low = quantile(samples, 0.01),
                 high = std::max<double>(quantile(samples, 0.99), low + 1);
    image.convertTo(gray, CV_8U, 255 / (high - low), -255 * low / (high - low));
  }
  return gray;
}

using Corners = MatCorners;

/// Corners of all tags of the design, in the image's own pixels.
Corners detect(const cv::Mat& gray, const MatDesign& design, int largest_side_px) {
  const int side = std::max(gray.cols, gray.rows);
  // Seen at 10 degrees a tag is a few pixels high: interpolation lets the detector read its cells.
  const double scale = 2 * side <= largest_side_px
                           ? 2.0
                           : std::min(1.0, static_cast<double>(largest_side_px) / side);
  cv::Mat search = gray;
  if (scale != 1)
    cv::resize(gray, search, {}, scale, scale, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  parameters->cornerRefinementWinSize = 3;     // cells of distant tags have few pixels
  parameters->minMarkerPerimeterRate = 0.015;  // many small tags
  parameters->detectInvertedMarker = true;
  std::vector<std::vector<cv::Point2f>> tags;
  std::vector<int> ids;
  cv::aruco::detectMarkers(search, dictionary_of(design), tags, ids, parameters);
  Corners out;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] >= design.tags()) continue;
    const auto corners = design.corners_m(ids[i]);
    for (std::size_t c = 0; c < 4; ++c) {
      out.mat.emplace_back(corners[c].x(), corners[c].y(), corners[c].z());
      // Pixel centres: at scale s, x' + 0.5 = s (x + 0.5).
      out.image.emplace_back((tags[i][c].x + 0.5) / scale - 0.5,
                             (tags[i][c].y + 0.5) / scale - 0.5);
    }
  }
  return out;
}

/// Only tags that agree with one plane; false detections and bent paper go.
std::optional<Eigen::Matrix3d> agree_on_plane(Corners& corners, double max_error_px,
                                              std::size_t min_corners) {
  if (corners.image.size() < min_corners) return std::nullopt;
  std::vector<cv::Point2d> plane;
  for (const cv::Point3d& p : corners.mat) plane.emplace_back(p.x, p.y);
  std::vector<unsigned char> good;
  const cv::Mat h =
      cv::findHomography(plane, corners.image, cv::RANSAC, max_error_px, good, 2000, 0.999);
  if (h.empty()) return std::nullopt;
  Corners kept;
  for (std::size_t i = 0; i < good.size(); i += 4) {
    if (!good[i] || !good[i + 1] || !good[i + 2] || !good[i + 3]) continue;
    for (std::size_t c = i; c < i + 4; ++c) {
      kept.mat.push_back(corners.mat[c]);
      kept.image.push_back(corners.image[c]);
    }
  }
  corners = std::move(kept);
  if (corners.image.size() < min_corners) return std::nullopt;
  Eigen::Matrix3d out;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) out(r, c) = h.at<double>(r, c);
  }
  return out;
}

OrbitPosition position_of(const Eigen::Vector2d& angles) {
  return {angles[0] < 0 ? angles[0] + 360 : angles[0], angles[1], 0, 0};
}

}  // namespace

Status MatFinderOptions::validate() const {
  const OptionCheck check("mat");
  ORBITFUSE_TRY(check("min_tags", min_tags, at_least(1)));
  ORBITFUSE_TRY(check("max_error_px", max_error_px, above(0)));
  return check("largest_side_px", largest_side_px, at_least(320));
}

MatFinder::MatFinder(const MatDesign& design, MatFinderOptions options)
    : design_(design), options_(options), scene_(design.size_m) {}

void MatFinder::set_focal_px(Modality modality, double focal_px) {
  known_focal_px_[modality] = focal_px;
}

std::optional<double> MatFinder::focal_px(Modality modality) const {
  if (const auto known = known_focal_px_.find(modality); known != known_focal_px_.end())
    return known->second;
  const auto estimate = estimates_.find(modality);
  return estimate == estimates_.end() ? std::nullopt : estimate->second.focal_px();
}

std::optional<MatSighting> MatFinder::place_by_scene(const cv::Mat& gray, Modality modality) {
  const std::optional<double> focal = focal_px(modality);
  if (modality != Modality::visible || !focal) return std::nullopt;
  const auto seen = scene_.follow(gray, *focal);
  if (!seen) return std::nullopt;
  MatSighting sighting;
  sighting.cam_from_mat = seen->cam_from_mat;
  sighting.position = position_of(angles_of(seen->cam_from_mat));
  sighting.position.sigma_deg = seen->sigma_deg;
  sighting.error_px = seen->error_px;
  sighting.followed = true;
  return sighting;
}

std::optional<MatSighting> MatFinder::find(const cv::Mat& image, Modality modality) {
  const cv::Mat gray = gray_of(image);
  if (gray.empty() || std::min(gray.cols, gray.rows) < 32) return std::nullopt;
  Corners corners = detect(gray, design_, options_.largest_side_px);
  const double max_error_px = options_.max_error_px * std::max(1.0, static_cast<double>(gray.cols) /
                                                                        options_.largest_side_px);
  const auto min_corners = 4 * static_cast<std::size_t>(options_.min_tags);
  auto h = agree_on_plane(corners, max_error_px, min_corners);
  MatTracker& tracker = trackers_[modality];
  const bool followed = !h;
  if (h) {
    tracker.remember(gray, corners);
  } else if (std::optional<MatSighting> placed = place_by_scene(gray, modality)) {
    return placed;
  } else if (std::optional<Corners> moved = tracker.follow(gray)) {
    corners = *std::move(moved);
    h = agree_on_plane(corners, max_error_px, min_corners);
  }
  if (!h) return std::nullopt;
  const double cx = 0.5 * (gray.cols - 1),
               cy = 0.5 * (gray.rows - 1);  // pixel centres are whole numbers here
  Eigen::Matrix3d centred = Eigen::Matrix3d::Identity();
  centred(0, 2) = -cx;
  centred(1, 2) = -cy;
  // The plane in units of its size, so that perspective terms compare between mats.
  const Eigen::Matrix3d unit = Eigen::Vector3d(design_.size_m, design_.size_m, 1).asDiagonal();
  if (!followed) estimates_[modality].add(centred * *h * unit, gray.cols);
  const std::optional<double> focal = focal_px(modality);
  if (!focal) return std::nullopt;

  const cv::Matx33d k(*focal, 0, cx, 0, *focal, cy, 0, 0, 1);
  std::vector<cv::Mat> rotations, translations;
  cv::solvePnPGeneric(corners.mat, corners.image, k, cv::noArray(), rotations, translations, false,
                      cv::SOLVEPNP_IPPE);
  std::vector<std::pair<double, std::size_t>> ranked;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    cv::solvePnPRefineLM(corners.mat, corners.image, k, cv::noArray(), rotations[i],
                         translations[i]);
    // The mat is printed on one side: a camera below it is the mirrored solution.
    if (angles_of(pose_of(rotations[i], translations[i]))[1] <= 0) continue;
    ranked.emplace_back(reprojection_rms_px(corners, k, rotations[i], translations[i]), i);
  }
  if (ranked.empty()) return std::nullopt;
  std::sort(ranked.begin(), ranked.end());
  const std::size_t best = ranked[0].second;
  const PoseVector pose = pose_of(rotations[best], translations[best]);
  if (!pose.allFinite()) return std::nullopt;
  MatSighting sighting;
  sighting.cam_from_mat = rigid_of(pose);
  sighting.tags = static_cast<int>(corners.image.size() / 4);
  sighting.error_px = ranked[0].first;
  const Eigen::Vector2d angles = angles_of(pose);
  sighting.position = position_of(angles);
  sighting.position.sigma_deg =
      direction_sigma_deg(corners, k, rotations[best], translations[best], sighting.error_px);
  if (ranked.size() > 1 && ranked[1].first < 1.5 * ranked[0].first) {
    const Eigen::Vector2d other =
        angles_of(pose_of(rotations[ranked[1].second], translations[ranked[1].second]));
    sighting.position.sigma_deg +=
        std::hypot(angle_difference_deg(other[0], angles[0]), other[1] - angles[1]) / 2;
  }
  sighting.followed = followed;
  if (!followed) sighting.corners = corners;
  if (followed) {
    sighting.position.sigma_deg += followed_sigma_deg;
  } else if (modality == Modality::visible) {
    scene_.remember(gray, *focal, sighting.cam_from_mat, sighting.position.sigma_deg);
  }
  return sighting;
}

}  // namespace orbitfuse
