// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "recon/nerf/field/occupancy.hpp"
#include "recon/nerf/field/space.hpp"
#include "recon/nerf/field/view_rays.hpp"
#include "recon/nerf/options.hpp"
#include "recon/nerf/training_views.hpp"

namespace orbitfuse::nerf {

/// One view in normalised space.
struct NormalisedView {
  std::string name;
  ViewRays rays;
  cv::Mat target;    ///< CV_32FC3 or CV_32FC1, mapped by the span
  cv::Mat distance;  ///< CV_32FC1 at the image's size: known distance along the ray, NaN = none
  std::vector<std::int32_t> known;  ///< pixels (y * width + x) whose distance is known
  cv::Mat clearance_px = {};  ///< PlainBackground::clearance_px; empty: there is no such background
};

/// The ball of the scene that these views and points show (core/geometry/scene_ball.hpp).
Space estimate_space(const Dataset& training);

/// The span's values become 0..1.
cv::Mat normalised(const cv::Mat& image, ValueSpan span);

std::vector<NormalisedView> prepare_views(const Dataset& dataset, const Space& space,
                                          ValueSpan span);

/// Switches off cells that too few training views see and cells in front of depth that these know
/// (SfM tracks, depth maps; `dense_depth` as Dataset::has_dense_depth). Returns the fraction left
/// on.
double carve(bool dense_depth, const std::vector<NormalisedView>& views,
             const std::vector<bool>& heldout, const TrainOptions& options, Occupancy& occupancy);

}  // namespace orbitfuse::nerf
