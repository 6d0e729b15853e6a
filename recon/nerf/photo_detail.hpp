// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/nerf/field.hpp"
#include "recon/nerf/kept_renders.hpp"
#include "recon/nerf/nerf.hpp"

namespace orbitfuse::nerf {

/// A recorded view that may lend detail. `image`: as TrainingView::image, of the view's camera's
/// size; it is read when a new view first asks for it.
struct DetailSource {
  PosedView view;
  std::function<Result<cv::Mat>()> image;
  /// The frame's own, of which the view's is a smaller one: whatever the view's size, the field is
  /// rendered by the same camera where it stands.
  Camera recorded = view.camera;
};

struct DetailOptions {
  /// Recorded views that lend a new view their detail, the nearest by direction; 0 = none. Where
  /// views stand 30 degrees apart three and four gain alike (28.40 dB; two 28.29, six 28.38:
  /// docs/notes/nerf.md).
  int sources = 4;
  /// The field is rendered at this width where the sources stand; what is finer is the sources'
  /// own, so that it should not be far below what the field learned from. 240 loses 0.3 dB, 640
  /// gains 0.1 for half as much time again.
  int base_width_px = 320;
  double depth_tolerance = 0.01;  ///< relative; a source that is farther off sees another surface
  double angle_deg = 10;          ///< between rays over which a source's weight falls by e
  /// The field's own weight: a lone source 30 degrees off counts half.
  double field_weight = 0.05;
  /// A source whose mean over a neighbourhood is this share of the value range off the field's
  /// shows something else there (a passer-by, a highlight) and hardly counts.
  double unexplained = 0.1;
  Status validate() const;
};

struct DetailTrial {
  int views = 0;                 ///< recorded views that were compared
  double without = 0, with = 0;  ///< mean absolute difference to them, in value ranges
  bool helps() const { return views > 0 && with < without; }
};

/// What recorded views show and the field, trained on fewer pixels for a limited time, does not.
/// Each source's difference to the field as its camera sees it is carried to a new view over the
/// field's depth, and the sources' mean is added to the rendered values. Places that a source can't
/// see are told by depth, weights fall with the angle between the rays (Buehler et al. 2001,
/// "Unstructured lumigraph rendering"), with the difference's mean over a neighbourhood, and
/// towards the edges of pictures and of what is seen.
class PhotoDetail {
 public:
  /// No sources: add() does nothing. All calls of one object are for one field.
  PhotoDetail() = default;
  /// Sources and field share one world frame. `kept`: of the same field; asked first, and added to.
  /// Errors: usage (options).
  static Result<PhotoDetail> of(std::vector<DetailSource> sources, const DetailOptions& options,
                                std::shared_ptr<KeptRenders> kept = nullptr);

  bool empty() const { return sources_.empty(); }
  /// Of the sources' views, in their order.
  std::vector<std::string> names() const;

  /// Makes ready one of the sources that a view needs, `depth` its own as the field has it: a
  /// render at the base width. False: all are, and add() takes no longer than the view's own pixels
  /// do. Errors: as add().
  Result<bool> prepare_one(const Field& field, const Camera& camera, const Rigid3d& cam_from_world,
                           const cv::Mat& depth, const Progress& progress);

  /// Adds to `seen`, which `field` rendered from there; depth and opacity stay. The source called
  /// `except` lends nothing: a recorded view is compared with what the others know. Returns the
  /// share of the pixels that got detail. Sources within a degree of `except` lend nothing either:
  /// they are as good as that view. The same for any thread count. Errors: input (an image
  /// that can't be read, or isn't of its camera's size), cancelled.
  Result<double> add(const Field& field, const Camera& camera, const Rigid3d& cam_from_world,
                     RenderedView& seen, const Progress& progress, const std::string& except = {});

  /// Whether detail helps: the middle half of views called `names` (where the object is), rendered
  /// without and with the others' detail, at twice the base width. Where depth is wrong it lands in
  /// the wrong places. Meant for views that the field never saw; those it learned from look better
  /// without than new ones do. Names that aren't sources' are passed over. Errors: as add().
  Result<DetailTrial> try_on(const Field& field, const std::vector<std::string>& names,
                             const Progress& progress);

 private:
  struct Source {
    DetailSource recorded;
    cv::Mat difference;  ///< CV_16S, of 32767 value ranges; empty until asked for
    cv::Mat confidence;  ///< CV_8U
    cv::Mat depth;       ///< CV_32F, at the base width
    long last_asked = 0;
    std::size_t bytes() const;
  };
  class NewView;

  std::vector<Source*> nearest(const Eigen::Vector3d& from, const Eigen::Vector3d& looked_at,
                               const std::string& except);
  Camera base_of(const DetailSource& source) const;
  Status prepare(const Field& field, const Progress& progress, Source& source) const;
  void forget_old(const std::vector<Source*>& needed);

  DetailOptions options_;
  std::vector<Source> sources_;
  std::shared_ptr<KeptRenders> kept_;
  long asked_ = 0;
};

}  // namespace orbitfuse::nerf
