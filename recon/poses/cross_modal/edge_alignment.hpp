// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"
#include "recon/poses/cross_modal/line_model.hpp"
#include "recon/poses/cross_modal/orbit_search.hpp"

// From a rough pose to a fraction of a pixel: first a pattern search on blurred orientation, view
// by view, then all views together in Ceres, the projected lines drawn to the image edges that run
// along them (RAPID, Harris 1990), with one lens shared and its focal prior kept.
namespace orbitfuse {

/// Mean agreement of the visible lines with a field, in [-1, 1]; 0 when nothing is visible.
double alignment_score(const LineModel& lines, const Camera& camera, const Rigid3d& cam_from_world,
                       const cv::Mat& field);

struct PatternSteps {
  double angle_deg = 3, radius = 0.06, roll_deg = 1.5, shift_px = 8;
  int halvings = 4;
};
/// Where a view should be, by the other views of its loop; weight 0: not known.
struct OrbitPrior {
  OrbitPose pose;
  double azimuth_sigma_deg = 6, elevation_sigma_deg = 3, radius_relative_sigma = 0.06;
  double weight = 0;  ///< agreement lost per squared sigma

  double penalty(const OrbitPose& at) const;
};

/// Coordinate descent on azimuth, elevation, radius, roll and shifts from `start`; maximises
/// the agreement less the prior's penalty.
OrbitPose pattern_search(const LineModel& lines, const Camera& camera, const cv::Mat& field,
                         OrbitPose start, const PatternSteps& steps, const OrbitPrior& prior = {});

struct AlignmentView {
  cv::Mat field;  ///< at full resolution, sharp
  PosedView view;
};

struct AlignmentOptions {
  double first_reach_px = 14, last_reach_px = 3;
  int rounds = 10;
  double step_px = 6;           ///< between samples on a line
  double min_agreement = 0.25;  ///< of an image edge that a line may be drawn to
  double focal_px = 0;          ///< prior; 0 = the views' own
  double focal_relative_sigma = 0.03;
};

struct AlignmentReport {
  double focal_px = 0;
  double focal_relative_sigma = 0;    ///< from the covariance
  std::vector<double> residual_px;    ///< per view: robust (median) distance of matched samples
  std::vector<double> matched_share;  ///< per view: samples with an image edge within reach
  std::vector<int> samples;           ///< per view
};

/// Refines all poses and the shared focal.
/// Errors: quality when no view has enough matched edges.
Result<AlignmentReport> align_edges(const LineModel& lines, std::vector<AlignmentView>& views,
                                    const AlignmentOptions& options, const Progress& progress);

}  // namespace orbitfuse
