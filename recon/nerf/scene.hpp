// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "recon/nerf/dataset.hpp"
#include "recon/nerf/occupancy.hpp"
#include "recon/nerf/options.hpp"
#include "recon/nerf/space.hpp"
#include "recon/nerf/view_rays.hpp"

namespace orbitfuse::nerf {

/// Linear map from stored samples to what the network learns: value = low + (high - low) * target.
struct ValueSpan {
  double low = 0, high = 1;
};

/// One view in normalised space.
struct SceneView {
  std::string name;
  ViewRays rays;
  cv::Mat target;    ///< CV_32FC3 or CV_32FC1, mapped by the span
  cv::Mat distance;  ///< CV_32FC1 at the image's size: known distance along the ray, NaN = none
  std::vector<std::int32_t> known;  ///< pixels (y * width + x) whose distance is known
};

/// The scene's ball (core/scene_ball.hpp).
Space estimate_space(const Dataset& dataset);

/// Thermal: the 0.1 and 99.9 percentile over all views, at least 1 K wide. Visible: 0..1.
ValueSpan estimate_span(const Dataset& dataset);

std::vector<SceneView> prepare_views(const Dataset& dataset, const Space& space, ValueSpan span);

/// Switches off cells that too few views see and cells in front of known depth (SfM tracks, depth
/// maps). Returns the fraction left on.
double carve(const Dataset& dataset, const std::vector<SceneView>& views, const TrainOptions& options,
             Occupancy& occupancy);

}  // namespace orbitfuse::nerf
