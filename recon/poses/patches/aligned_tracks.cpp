// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/patches/aligned_tracks.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "core/numeric/angle_units.hpp"
#include "core/option_range.hpp"
#include "core/system/parallel.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

const Eigen::Vector2d pixel_centre(0.5, 0.5);

/// What became of a point's track.
struct PointAlignment {
  std::vector<Observation> aligned, added;  ///< the reference is the first of `aligned`
  std::vector<Observation> left;            ///< as they were
  double squared_shifts = 0;
};

class Aligner {
 public:
  Aligner(const Reconstruction& model, const std::vector<cv::Mat>& images,
          const TrackAlignmentOptions& options)
      : model_(model), images_(images), options_(options) {
    for (std::size_t v = 0; v < model.views.size(); ++v) {
      const PosedView& view = model.views[v];
      cameras_.push_back(view.camera.scaled_to(images[v].cols, images[v].rows));
      world_from_cam_.push_back(view.cam_from_world.inverse());
    }
  }

  PointAlignment align(const SparsePoint& point) const {
    PointAlignment result;
    if (point.track.empty()) return result;
    const Observation reference = most_central(point);
    const auto patch =
        PatchTemplate::at(images_[at(reference.view)], in_image(reference), options_.patch);
    if (!patch) {
      result.left = point.track;
      return result;
    }
    result.aligned.push_back(reference);
    for (const Observation& seen : point.track) {
      if (seen.view == reference.view) continue;
      const Eigen::Vector2d start = in_image(seen);
      const auto found = find(point, reference, *patch, seen.view, start, options_.min_correlation,
                              options_.max_shift_px);
      if (!found) {
        result.left.push_back(seen);
        continue;
      }
      result.squared_shifts += (*found - start).squaredNorm();
      result.aligned.push_back(recorded(seen.view, *found));
    }
    // Where no feature of the track speaks for the patch, the model's own poses alone would.
    if (result.aligned.size() > 1) add_views(point, reference, *patch, result);
    return result;
  }

 private:
  /// Where the point should be seen from nearly the same side.
  void add_views(const SparsePoint& point, const Observation& reference, const PatchTemplate& patch,
                 PointAlignment& result) const {
    const double least_cosine = std::cos(options_.max_added_angle_deg * radians_per_degree);
    const Eigen::Vector3d towards = direction(point, reference.view);
    std::vector<std::pair<double, int>> near;
    for (int v = 0; v < static_cast<int>(cameras_.size()); ++v) {
      const bool known = std::any_of(point.track.begin(), point.track.end(),
                                     [&](const Observation& seen) { return seen.view == v; });
      const double cosine = towards.dot(direction(point, v));
      if (!known && cosine >= least_cosine && shows(v, point.position))
        near.emplace_back(-cosine, v);
    }
    std::sort(near.begin(), near.end());
    near.resize(std::min(near.size(), static_cast<std::size_t>(options_.max_added_views)));
    for (const auto& [nearness, v] : near) {
      const auto found =
          find(point, reference, patch, v, projected(point.position, v) - pixel_centre,
               options_.min_added_correlation, options_.max_added_shift_px);
      if (found) result.added.push_back(recorded(v, *found));
    }
  }

  bool shows(int view, const Eigen::Vector3d& position) const {
    const Eigen::Vector2d pixel = projected(position, view);
    const Camera& camera = cameras_[at(view)];
    return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.width &&
           pixel.y() < camera.height;  // not where it is NaN: behind the camera
  }

  Eigen::Vector2d in_image(const Observation& seen) const {
    const Camera &of_view = model_.views[at(seen.view)].camera, &camera = cameras_[at(seen.view)];
    return Eigen::Vector2d(seen.pixel.x() * camera.width / of_view.width,
                           seen.pixel.y() * camera.height / of_view.height) -
           pixel_centre;
  }
  Observation recorded(int view, const Eigen::Vector2d& place) const {
    const Camera &of_view = model_.views[at(view)].camera, &camera = cameras_[at(view)];
    const Eigen::Vector2d pixel = place + pixel_centre;
    return {view,
            {pixel.x() * of_view.width / camera.width, pixel.y() * of_view.height / camera.height}};
  }
  Eigen::Vector2d projected(const Eigen::Vector3d& x, int view) const {
    return cameras_[at(view)].project(model_.views[at(view)].cam_from_world * x);
  }
  /// From the point to the view.
  Eigen::Vector3d direction(const SparsePoint& point, int view) const {
    return (world_from_cam_[at(view)].translation - point.position).normalized();
  }

  /// Of a track's observations, the one that looks most nearly as all others do.
  Observation most_central(const SparsePoint& point) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Observation& seen : point.track) sum += direction(point, seen.view);
    return *std::max_element(
        point.track.begin(), point.track.end(), [&](const Observation& a, const Observation& b) {
          return sum.dot(direction(point, a.view)) < sum.dot(direction(point, b.view));
        });
  }

  /// How a step in the reference's image goes over, if the surface faces both views.
  Eigen::Matrix2d linear_between(const SparsePoint& point, const Observation& reference,
                                 int view) const {
    const Rigid3d& world_from_ref = world_from_cam_[at(reference.view)];
    const Eigen::Vector3d normal = direction(point, reference.view) + direction(point, view);
    const double distance = normal.dot(point.position - world_from_ref.translation);
    const Eigen::Vector2d centre = in_image(reference) + pixel_centre;
    const auto across = [&](const Eigen::Vector2d& pixel) {
      const Eigen::Vector3d ray =
          world_from_ref.rotation * cameras_[at(reference.view)].ray_of(pixel);
      return projected(world_from_ref.translation + distance / normal.dot(ray) * ray, view);
    };
    constexpr double reach_px = 3;
    Eigen::Matrix2d linear;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = reach_px * Eigen::Vector2d::Unit(axis);
      linear.col(axis) = (across(centre + step) - across(centre - step)) / (2 * reach_px);
    }
    return linear;
  }

  std::optional<Eigen::Vector2d> find(const SparsePoint& point, const Observation& reference,
                                      const PatchTemplate& patch, int view,
                                      const Eigen::Vector2d& start, double min_correlation,
                                      double max_shift_px) const {
    const PatchPlace place{start, linear_between(point, reference, view)};
    if (!place.linear.allFinite() || !magnifies_little(place.linear)) return {};
    const auto found = patch.align(images_[at(view)], place);
    if (!found || found->correlation < min_correlation || found->sigma_px > options_.max_sigma_px ||
        (found->place.centre - start).norm() > max_shift_px)
      return {};
    return found->place.centre;
  }

  bool magnifies_little(const Eigen::Matrix2d& linear) const {
    const Eigen::Vector2d by = linear.jacobiSvd().singularValues();
    return by(0) <= options_.max_magnification && by(1) * options_.max_magnification >= 1;
  }

  const Reconstruction& model_;
  const std::vector<cv::Mat>& images_;
  const TrackAlignmentOptions& options_;
  std::vector<Camera> cameras_;
  std::vector<Rigid3d> world_from_cam_;
};

/// Views that what was found again of their own features would hold too weakly.
std::vector<bool> short_of_observations(const std::vector<PointAlignment>& points,
                                        std::size_t views, int least) {
  std::vector<int> count(views, 0);
  for (const PointAlignment& point : points)
    if (point.aligned.size() > 1)
      for (const Observation& seen : point.aligned) ++count[at(seen.view)];
  std::vector<bool> few;
  for (const int seen : count) few.push_back(seen < least);
  return few;
}

/// What was found, and of the rest what views with too few observations need.
std::vector<Observation> track_of(const PointAlignment& aligned, const std::vector<bool>& few) {
  std::vector<Observation> track = aligned.aligned;
  track.insert(track.end(), aligned.added.begin(), aligned.added.end());
  const auto needed = [&](const Observation& left) { return few[at(left.view)]; };
  std::copy_if(aligned.left.begin(), aligned.left.end(), std::back_inserter(track), needed);
  const bool helps_a_view = std::any_of(aligned.left.begin(), aligned.left.end(), needed) ||
                            (!aligned.aligned.empty() && needed(aligned.aligned.front()));
  // One of a weak view's features means nothing without another of its track.
  for (const Observation& left : aligned.left)
    if (helps_a_view && !needed(left) && track.size() < 2) track.push_back(left);
  return track;
}

}  // namespace

Status TrackAlignmentOptions::validate() const {
  ORBITFUSE_TRY(patch.validate());
  const OptionCheck check("track_alignment");
  ORBITFUSE_TRY(check("min_correlation", min_correlation, from_to(0, 1)));
  ORBITFUSE_TRY(check("max_shift_px", max_shift_px, above_up_to(0, 100)));
  ORBITFUSE_TRY(check("max_sigma_px", max_sigma_px, above_up_to(0, 10)));
  ORBITFUSE_TRY(check("max_magnification", max_magnification, from_to(1, 8)));
  ORBITFUSE_TRY(check("min_added_correlation", min_added_correlation, from_to(0, 1)));
  ORBITFUSE_TRY(check("max_added_shift_px", max_added_shift_px, above_up_to(0, 100)));
  ORBITFUSE_TRY(check("max_added_angle_deg", max_added_angle_deg, from_to(0, 90)));
  ORBITFUSE_TRY(check("max_added_views", max_added_views, from_to(0, 1e6)));
  return check("min_aligned_a_view", min_aligned_a_view, from_to(0, 1e6));
}

Result<TrackAlignment> align_tracks(const Reconstruction& model, const std::vector<cv::Mat>& images,
                                    const TrackAlignmentOptions& options,
                                    const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  assert(images.size() == model.views.size());
  const Aligner aligner(model, images, options);
  std::vector<PointAlignment> points(model.points.size());
  constexpr int block = 64;
  parallel_blocks(static_cast<int>(points.size()), block, [&](int begin, int end) {
    for (int i = begin; i < end && !progress.cancelled(); ++i)
      points[at(i)] = aligner.align(model.points[at(i)]);
  });
  ORBITFUSE_TRY(progress.check("alignment of patches"));
  const std::vector<bool> few =
      short_of_observations(points, model.views.size(), options.min_aligned_a_view);
  TrackAlignment result;
  result.model.modality = model.modality;
  result.model.views = model.views;
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PointAlignment& aligned = points[i];
    const bool compared = !aligned.aligned.empty();
    result.aligned += static_cast<int>(aligned.aligned.size()) - (compared ? 1 : 0);
    result.added += static_cast<int>(aligned.added.size());
    if (!aligned.left.empty())
      result.unaligned += static_cast<int>(aligned.left.size()) - (compared ? 0 : 1);
    squares += aligned.squared_shifts;
    SparsePoint point = model.points[i];
    point.track = track_of(aligned, few);
    if (point.track.size() < 2) point.track.clear();
    result.left_out += static_cast<int>(
        std::count_if(aligned.left.begin(), aligned.left.end(), [&](const Observation& left) {
          return std::none_of(point.track.begin(), point.track.end(),
                              [&](const Observation& kept) { return kept.view == left.view; });
        }));
    if (!point.track.empty()) result.model.points.push_back(std::move(point));
  }
  result.rms_shift_px = std::sqrt(squares / std::max(result.aligned, 1));
  return result;
}

}  // namespace orbitfuse
