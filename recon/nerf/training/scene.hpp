// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "recon/nerf/dataset.hpp"
#include "recon/nerf/field/occupancy.hpp"
#include "recon/nerf/options.hpp"
#include "recon/nerf/field/space.hpp"
#include "recon/nerf/field/value_span.hpp"
#include "recon/nerf/field/view_rays.hpp"

namespace orbitfuse::nerf {

/// One view in normalised space.
struct NormalisedView {
  std::string name;
  ViewRays rays;
  cv::Mat target;    ///< CV_32FC3 or CV_32FC1, mapped by the span
  cv::Mat distance;  ///< CV_32FC1 at the image's size: known distance along the ray, NaN = none
  std::vector<std::int32_t> known;  ///< pixels (y * width + x) whose distance is known
};

/// Views that don't train: those marked so, and every n-th of the others (0 = none).
std::vector<bool> heldout_views(const Dataset& dataset, int holdout_every);

/// Thermal views of which more than half is no temperature: a broken transfer, a shutter in the way.
std::vector<bool> broken_views(const Dataset& dataset);
/// Share of an image's pixels that hold no value.
double invalid_share(const cv::Mat& image);

/// Of the views given to train(): the broken ones, and of the others those that don't train.
std::vector<bool> left_out_views(const Dataset& given, int holdout_every);

/// What training may know: the dataset without held-out views, their depth maps and the points that
/// only they saw. Images are shared, not copied.
Dataset training_part(const Dataset& dataset, const std::vector<bool>& heldout);

/// The ball of the scene that these views and points show (core/geometry/scene_ball.hpp).
Space estimate_space(const Dataset& training);

/// Thermal: the 0.1 and 99.9 percentile over these views, at least 1 K wide. Visible: 0..1.
ValueSpan estimate_span(const Dataset& training);

std::vector<NormalisedView> prepare_views(const Dataset& dataset, const Space& space, ValueSpan span);

/// Switches off cells that too few training views see and cells in front of depth that these know
/// (SfM tracks, depth maps; `dense_depth` as Dataset::has_dense_depth). Returns the fraction left on.
double carve(bool dense_depth, const std::vector<NormalisedView>& views, const std::vector<bool>& heldout,
             const TrainOptions& options, Occupancy& occupancy);

}  // namespace orbitfuse::nerf
