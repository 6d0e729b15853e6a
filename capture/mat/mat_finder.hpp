// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <optional>

#include "capture/guide/coverage.hpp"
#include "capture/mat/focal_estimate.hpp"
#include "capture/mat/mat_design.hpp"
#include "capture/mat/mat_tracker.hpp"
#include "capture/mat/scene_odometry.hpp"
#include "core/geometry/transform.hpp"

namespace orbitfuse {

struct MatFinderOptions {
  int min_tags = 3;            ///< fewer prove nothing: one false tag could speak alone
  double max_error_px = 2;     ///< tags further from the common plane are taken for false ones
  int largest_side_px = 1600;  ///< larger images are reduced for the search; photos have 4000

  Status validate() const;
};

struct MatSighting {
  OrbitPosition position;  ///< sigma from the fit; the speed is the caller's
  Rigid3d cam_from_mat;
  int tags = 0;
  bool followed = false;  ///< not read: by optical flow of the mat, or by odometry on the scene
  double error_px = 0;    ///< root mean square, at the image's own size
  MatCorners corners;     ///< as read, centres of pixels at whole numbers; of followed ones none
};

/// Finds the mat in images, given in their order, and says where the camera stands in the mat's
/// frame. Tags may appear dark on bright or bright on dark (foil can be warmer or colder than
/// paint). The pose is that of the plane with the least reprojection error (IPPE, Collins and
/// Bartoli, IJCV 2014, then Levenberg-Marquardt); where the mirrored pose fits nearly as well the
/// sigma says so. The camera is a pinhole with its principal point in the middle; its focal length
/// is given or is learnt from the sightings. Visible images without a readable mat are placed by
/// SceneOdometry, with its growing sigma; else the mat's corners are followed (MatTracker), with
/// one beyond what counts.
class MatFinder {
 public:
  explicit MatFinder(const MatDesign& design, MatFinderOptions options = {});

  void set_focal_px(Modality modality, double focal_px);
  /// What is used for images of this camera now; nothing before enough is known.
  std::optional<double> focal_px(Modality modality) const;

  /// `image`: upright CV_8UC3, CV_8UC1 or CV_16UC1 (centikelvin, 0 = no sample). Nothing when too
  /// few tags are seen or the pose is not determined.
  std::optional<MatSighting> find(const cv::Mat& image, Modality modality);

 private:
  std::optional<MatSighting> place_by_scene(const cv::Mat& gray, Modality modality);
  MatDesign design_;
  MatFinderOptions options_;
  std::map<Modality, double> known_focal_px_;
  std::map<Modality, FocalEstimate> estimates_;
  std::map<Modality, MatTracker> trackers_;
  SceneOdometry scene_;  ///< of visible images
};

}  // namespace orbitfuse
