// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"

namespace orbitfuse {

/// What is known of a lens before the adjustment.
struct LensGroup {
  std::optional<double> focal_px;   ///< mean of the prior, if there is one
  double focal_relative_sigma = 0;  ///< of the prior; 0: its focal length is held
  bool refine_principal_point = true;
  bool refine_distortion = true;
};

struct BundleOptions {
  /// Tukey-like loss beyond this many pixels (Cauchy scale): the tail of false matches.
  double loss_scale_px = 1.0;
  /// Observations above this after the first pass are dropped, then it runs again.
  double max_error_px = 4.0;
  /// A view with fewer observations is not supported and is dropped.
  int min_observations = 15;
  /// Points whose rays meet at less than this carry no depth and are dropped.
  double min_triangulation_angle_deg = 1.0;
  /// Prior of the principal point about the image centre, share of the width: lenses are off by up
  /// to about a hundredth. Looser, a poorly held scene trades it for a common turn of all cameras.
  double principal_point_sigma = 0.01;
  /// Prior of the tangential distortion (p1, p2) about none: a lens of today has some 0.0005. What
  /// it does to an image is what a shifted principal point and a turned camera do, so that a looser
  /// prior turns all cameras together.
  double tangential_sigma = 0.0005;
  /// Of each view, how many of its pixels count as one of those above: photos of several sizes are
  /// searched at like ones. Empty: one.
  std::vector<double> unit_px = {};
  int max_iterations = 60;
};

struct BundleReport {
  double rms_px = 0;  ///< over kept observations, of their views' units
  int observations = 0, outliers = 0;
  bool converged = false;
  double median_triangulation_angle_deg = 0;
  /// One standard deviation of each group's focal from the covariance, share of the focal; NaN
  /// when it was held, no view has it or the normal equations are singular.
  std::vector<double> focal_relative_sigma;
  std::vector<std::string> dropped_views;
  std::vector<std::string> warnings;
};

/// Robust bundle adjustment: views of a group share their intrinsics (group[v] indexes
/// `lenses`), points and poses are free, the gauge is fixed by the first view and the distance to
/// the farthest other. The same for any number of threads. Drops outliers and unsupported views
/// from `model`. Errors: input (sizes or values that make no sense), quality (no parallax: pure
/// rotation; fewer than two supported views; no convergence to finite values). `model` is unchanged
/// on error.
Result<BundleReport> adjust_bundle(Reconstruction& model, const std::vector<int>& group,
                                   const std::vector<LensGroup>& lenses,
                                   const BundleOptions& options);

}  // namespace orbitfuse
