// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/patches/aligned_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/numeric/angle_units.hpp"
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
    add_views(point, reference, *patch, result);
    return result;
  }

 private:
  /// Where the point should be seen from nearly the same side.
  void add_views(const SparsePoint& point, const Observation& reference, const PatchTemplate& patch,
                 PointAlignment& result) const {
    const double least_cosine = std::cos(options_.max_added_angle_deg * radians_per_degree);
    const Eigen::Vector3d towards = direction(point, reference.view);
    for (int v = 0; v < static_cast<int>(cameras_.size()); ++v) {
      const bool known = std::any_of(point.track.begin(), point.track.end(),
                                     [&](const Observation& seen) { return seen.view == v; });
      if (known || towards.dot(direction(point, v)) < least_cosine) continue;
      const Eigen::Vector2d start = projected(point.position, v) - pixel_centre;
      if (!start.allFinite()) continue;
      const auto found = find(point, reference, patch, v, start, options_.min_added_correlation,
                              options_.max_added_shift_px);
      if (found) result.added.push_back(recorded(v, *found));
    }
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
    if (!place.linear.allFinite()) return {};
    const auto found = patch.align(images_[at(view)], place);
    if (!found || found->correlation < min_correlation || found->sigma_px > options_.max_sigma_px ||
        (found->place.centre - start).norm() > max_shift_px)
      return {};
    return found->place.centre;
  }

  const Reconstruction& model_;
  const std::vector<cv::Mat>& images_;
  const TrackAlignmentOptions& options_;
  std::vector<Camera> cameras_;
  std::vector<Rigid3d> world_from_cam_;
};

/// Views that aligned observations alone would hold too weakly.
std::vector<bool> short_of_observations(const std::vector<PointAlignment>& points,
                                        std::size_t views, int least) {
  std::vector<int> count(views, 0);
  for (const PointAlignment& point : points) {
    if (point.aligned.size() + point.added.size() < 2) continue;
    for (const auto* group : {&point.aligned, &point.added})
      for (const Observation& seen : *group) ++count[at(seen.view)];
  }
  std::vector<bool> few;
  for (const int seen : count) few.push_back(seen < least);
  return few;
}

}  // namespace

TrackAlignment align_tracks(const Reconstruction& model, const std::vector<cv::Mat>& images,
                            const TrackAlignmentOptions& options) {
  const Aligner aligner(model, images, options);
  std::vector<PointAlignment> points(model.points.size());
  constexpr int block = 64;
  parallel_blocks(static_cast<int>(points.size()), block, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) points[at(i)] = aligner.align(model.points[at(i)]);
  });
  const std::vector<bool> few =
      short_of_observations(points, model.views.size(), options.min_aligned_a_view);
  TrackAlignment result;
  result.model.modality = model.modality;
  result.model.views = model.views;
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    PointAlignment& aligned = points[i];
    result.aligned += std::max(static_cast<int>(aligned.aligned.size()) - 1, 0);
    result.added += static_cast<int>(aligned.added.size());
    squares += aligned.squared_shifts;
    SparsePoint point = model.points[i];
    point.track = std::move(aligned.aligned);
    point.track.insert(point.track.end(), aligned.added.begin(), aligned.added.end());
    const bool helps_a_view = std::any_of(aligned.left.begin(), aligned.left.end(),
                                          [&](const Observation& o) { return few[at(o.view)]; });
    // One of a weak view's features means nothing without another of its track.
    for (const Observation& left : aligned.left)
      if (few[at(left.view)] || (helps_a_view && point.track.size() < 2))
        point.track.push_back(left);
      else
        ++result.left_out;
    if (point.track.size() >= 2) result.model.points.push_back(std::move(point));
  }
  result.rms_shift_px = std::sqrt(squares / std::max(result.aligned, 1));
  return result;
}

}  // namespace orbitfuse
