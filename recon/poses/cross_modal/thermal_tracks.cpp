// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/thermal_tracks.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "core/system/parallel.hpp"
#include "recon/poses/cross_modal/painted_scene.hpp"

namespace orbitfuse {
namespace {

/// Of the strongest corner; nearer ones than this to each other say the same.
constexpr double corner_quality = 0.002, corner_spacing_px = 5;
constexpr int corner_block_px = 5;

/// A row of a patch; what is left over weighs nothing.
using Lanes = Eigen::Array<float, 16, 1>;

/// A patch and the part of a painting that it is looked for in, each about a level of its own, so
/// that sums of squares keep their digits; rows of images are columns here.
class PatchSearch {
 public:
  PatchSearch(const cv::Mat1f& image, const cv::Mat1f& painted, cv::Point at,
              const ThermalTrackOptions& options)
      : side_(2 * options.radius_px + 1), least_painted_(options.min_painted * side_ * side_) {
    assert(side_ <= Lanes::SizeAtCompileTime);
    const int reach = options.reach_px, across = side_ + 2 * reach;
    patch_ = Eigen::ArrayXXf::Zero(Lanes::SizeAtCompileTime, side_);
    inside_ = Lanes::Zero();
    inside_.head(side_) = 1;
    const cv::Point corner = at - cv::Point(options.radius_px, options.radius_px);
    for (int v = 0; v < side_; ++v)
      for (int u = 0; u < side_; ++u) patch_(u, v) = image(corner.y + v, corner.x + u) - image(at);
    values_ = known_ = Eigen::ArrayXXf::Zero(2 * reach + Lanes::SizeAtCompileTime, across);
    const float level = painted(at);
    const float about = std::isfinite(level) ? level : image(at);
    for (int v = 0; v < across; ++v)
      for (int u = 0; u < across; ++u) {
        const float value = painted(corner.y - reach + v, corner.x - reach + u);
        if (!std::isfinite(value)) continue;
        values_(u, v) = value - about;
        known_(u, v) = 1;
      }
  }

  /// Pearson's correlation, shifted from the search's first corner; nothing where too little is
  /// painted or nothing varies.
  std::optional<double> correlation(int x, int y) const {
    Lanes n = Lanes::Zero(), sa = n, sb = n, saa = n, sbb = n, sab = n;
    for (int v = 0; v < side_; ++v) {
      const Lanes weight = known_.col(y + v).segment<Lanes::SizeAtCompileTime>(x) * inside_;
      const Lanes a = patch_.col(v) * weight;
      const Lanes b = values_.col(y + v).segment<Lanes::SizeAtCompileTime>(x) * weight;
      n += weight, sa += a, sb += b, saa += a * a, sbb += b * b, sab += a * b;
    }
    const auto sum = [](const Lanes& lanes) { return lanes.cast<double>().sum(); };
    const double count = sum(n);
    if (count < least_painted_) return std::nullopt;
    const double a = sum(sa), b = sum(sb);
    const double va = sum(saa) - a * a / count, vb = sum(sbb) - b * b / count;
    const double value = (sum(sab) - a * b / count) / std::sqrt(va * vb);
    return va > 0 && vb > 0 && std::isfinite(value) ? std::optional(value) : std::nullopt;
  }

 private:
  int side_;
  double least_painted_;
  Lanes inside_;
  Eigen::ArrayXXf patch_, values_, known_;
};

struct FoundPatch {
  Eigen::Vector2d shift;
  Eigen::Matrix2d sqrt_weight;
};

/// The peak to a fraction of a pixel; nothing where it is not one.
std::optional<FoundPatch> peak(const cv::Mat1f& score, double least) {
  const int reach = score.cols / 2;
  cv::Point at;
  double value = 0;
  cv::minMaxLoc(score, nullptr, &value, nullptr, &at);
  if (value < least || at.x == 0 || at.y == 0 || at.x == 2 * reach || at.y == 2 * reach)
    return std::nullopt;
  const auto s = [&](int dx, int dy) { return static_cast<double>(score(at.y + dy, at.x + dx)); };
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u)
      if (!std::isfinite(s(u, v))) return std::nullopt;
  const double across = (s(1, -1) + s(-1, 1) - s(1, 1) - s(-1, -1)) / 4;
  Eigen::Matrix2d curvature;
  curvature << 2 * s(0, 0) - s(1, 0) - s(-1, 0), across, across, 2 * s(0, 0) - s(0, 1) - s(0, -1);
  if (!(curvature.determinant() > 1e-6 * curvature.squaredNorm() && curvature.trace() > 0))
    return std::nullopt;
  const Eigen::Vector2d gradient((s(1, 0) - s(-1, 0)) / 2, (s(0, 1) - s(0, -1)) / 2);
  const Eigen::Vector2d step = curvature.inverse() * gradient;
  if (!(step.cwiseAbs().maxCoeff() <= 1)) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(curvature);
  const Eigen::Vector2d values = eigen.eigenvalues().cwiseMax(0);
  return FoundPatch{Eigen::Vector2d(at.x - reach, at.y - reach) + step,
                    eigen.eigenvectors() * (values / values.maxCoeff()).cwiseSqrt().asDiagonal() *
                        eigen.eigenvectors().transpose()};
}

std::optional<FoundPatch> find_patch(const cv::Mat1f& image, const cv::Mat1f& painted, cv::Point at,
                                     const ThermalTrackOptions& options) {
  const int reach = options.reach_px, margin = options.radius_px + reach;
  if (at.x < margin || at.y < margin || at.x >= image.cols - margin || at.y >= image.rows - margin)
    return std::nullopt;
  // Never a peak, and no neighbour of one.
  constexpr float unknown = -std::numeric_limits<float>::infinity();
  cv::Mat1f score(2 * reach + 1, 2 * reach + 1, unknown);
  const PatchSearch search(image, painted, at, options);
  for (int y = 0; y <= 2 * reach; ++y)
    for (int x = 0; x <= 2 * reach; ++x)
      if (const auto value = search.correlation(x, y)) score(y, x) = static_cast<float>(*value);
  return peak(score, options.min_correlation);
}

double depth_at(const cv::Mat& depth, const Eigen::Vector2d& pixel) {
  const auto x = static_cast<int>(std::floor(pixel.x()));
  const auto y = static_cast<int>(std::floor(pixel.y()));
  if (x < 0 || y < 0 || x >= depth.cols || y >= depth.rows) return 0;
  const auto z = static_cast<double>(depth.at<float>(y, x));
  return z > 0 ? z : 0;
}

/// The neighbour's pixel of what the view has found there, and what is known of it in the
/// neighbour's axes.
std::optional<ThermalSighting> sighting(const ThermalViews& views, std::size_t view,
                                        std::size_t neighbour, const Eigen::Vector2d& pixel,
                                        const FoundPatch& found) {
  const Eigen::Vector2d there = pixel + found.shift;
  const double depth = depth_at(views.depth[view], there);
  if (!(depth > 0)) return std::nullopt;
  const Rigid3d neighbour_from_view =
      views.cam_from_world[neighbour] * views.cam_from_world[view].inverse();
  const auto carried = [&](const Eigen::Vector2d& at) -> Eigen::Vector2d {
    return views.camera.project(neighbour_from_view *
                                Eigen::Vector3d(views.camera.ray_of(at) * depth));
  };
  const Eigen::Vector2d seen = carried(there);
  Eigen::Matrix2d neighbour_from_view_px;
  neighbour_from_view_px.col(0) = carried(there + Eigen::Vector2d(1, 0)) - seen;
  neighbour_from_view_px.col(1) = carried(there + Eigen::Vector2d(0, 1)) - seen;
  constexpr double least_area = 0.1;  // of a pixel that the neighbour sees almost from the side
  if (!seen.allFinite() || !(std::abs(neighbour_from_view_px.determinant()) > least_area))
    return std::nullopt;
  return ThermalSighting{neighbour, seen, found.sqrt_weight * neighbour_from_view_px.inverse()};
}

std::vector<std::size_t> neighbours_of(const ThermalViews& views, std::size_t view,
                                       const std::vector<std::size_t>& others,
                                       const ThermalTrackOptions& options) {
  std::vector<std::pair<double, std::size_t>> near;
  for (const std::size_t other : others) {
    const double turn = rotation_angle_deg(views.cam_from_world[view].rotation,
                                           views.cam_from_world[other].rotation);
    if (other != view && turn >= options.min_turn_deg && turn <= options.max_turn_deg)
      near.emplace_back(turn, other);
  }
  std::sort(near.begin(), near.end());
  near.resize(std::min(near.size(), static_cast<std::size_t>(std::max(0, options.neighbours))));
  std::vector<std::size_t> found;
  for (const auto& [turn, other] : near) found.push_back(other);
  return found;
}

/// Where the depth jumps within a patch. A nearer surface's outline is painted where the pose has
/// it, not where the neighbour saw it, so that such a patch says that the pose is right. Unknown
/// depth is no jump: what isn't painted isn't compared.
cv::Mat jumps_of(const cv::Mat& depth, const ThermalTrackOptions& options) {
  const cv::Mat known = depth == depth;
  cv::Mat nearest = depth.clone(), farthest = depth.clone(), near, far;
  nearest.setTo(std::numeric_limits<float>::max(), ~known);
  farthest.setTo(0, ~known);
  cv::erode(nearest, near, cv::Mat());
  cv::dilate(farthest, far, cv::Mat());
  cv::Mat jumps;
  cv::dilate(far > (1 + options.depth_tolerance) * near, jumps,
             cv::Mat::ones(2 * options.radius_px + 1, 2 * options.radius_px + 1, CV_8U));
  return jumps;
}

/// Corners away from dead pixels, which would blind the detector down their columns, and from jumps
/// of the depth.
std::vector<cv::Point2f> corners_of(const cv::Mat& image, const cv::Mat& depth,
                                    const ThermalTrackOptions& options) {
  std::vector<cv::Point2f> corners;
  const cv::Mat known = image == image;
  if (cv::countNonZero(known) == 0) return corners;
  cv::Mat filled = image.clone(), usable;
  filled.setTo(cv::mean(image, known), ~known);
  cv::erode(known, usable, cv::Mat(), {-1, -1}, corner_block_px);
  usable.setTo(0, jumps_of(depth, options));
  cv::goodFeaturesToTrack(filled, corners, options.max_patches, corner_quality, corner_spacing_px,
                          usable, corner_block_px);
  return corners;
}

std::vector<ThermalTrack> tracks_of(const ThermalViews& views, std::size_t view,
                                    const std::vector<std::size_t>& neighbours,
                                    const ThermalTrackOptions& options) {
  const cv::Mat& image = views.images[view];
  if (neighbours.empty()) return {};
  const std::vector<cv::Point2f> corners = corners_of(image, views.depth[view], options);
  std::vector<cv::Mat> paintings;
  for (const std::size_t other : neighbours)
    paintings.push_back(painted_by(
        {views.camera, views.cam_from_world[other], views.images[other], views.depth[other]},
        views.depth[view], views.camera, views.cam_from_world[view], options.depth_tolerance));
  const Rigid3d world_from_cam = views.cam_from_world[view].inverse();
  std::vector<ThermalTrack> tracks;
  for (const cv::Point corner : std::vector<cv::Point>(corners.begin(), corners.end())) {
    const Eigen::Vector2d pixel(corner.x + 0.5, corner.y + 0.5);
    const Eigen::Vector3d in_cam = views.camera.ray_of(pixel) * depth_at(views.depth[view], pixel);
    if (!(in_cam.z() > 0)) continue;
    ThermalTrack track{world_from_cam * in_cam,
                       (world_from_cam.rotation * in_cam).normalized(),
                       in_cam.norm(),
                       {{view, pixel}}};
    for (std::size_t k = 0; k < neighbours.size(); ++k)
      if (const auto found = find_patch(image, paintings[k], corner, options))
        if (const auto seen = sighting(views, view, neighbours[k], pixel, *found))
          track.sightings.push_back(*seen);
    if (track.sightings.size() > 1) tracks.push_back(std::move(track));
  }
  return tracks;
}

}  // namespace

std::vector<ThermalTrack> thermal_tracks(const ThermalViews& views,
                                         const std::vector<std::size_t>& chosen,
                                         const std::vector<std::size_t>& others,
                                         const ThermalTrackOptions& options) {
  std::vector<std::vector<ThermalTrack>> of_view(chosen.size());
  parallel_for(static_cast<int>(chosen.size()), [&](int index) {
    const auto c = static_cast<std::size_t>(index);
    of_view[c] =
        tracks_of(views, chosen[c], neighbours_of(views, chosen[c], others, options), options);
  });
  std::vector<ThermalTrack> all;
  for (std::vector<ThermalTrack>& tracks : of_view)
    std::move(tracks.begin(), tracks.end(), std::back_inserter(all));
  return all;
}

}  // namespace orbitfuse
