// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"
#include "recon/depth/options.hpp"

namespace orbitfuse::depth {

/// What nothing confirms and ground and sky explain, as shares of all pixels
/// (ground/extend_ground.hpp).
struct OpenSpace {
  double ground = 0, sky = 0;
};

struct DepthReport {
  double known = 0;       ///< share of all pixels with a confirmed depth
  double matched = 0;     ///< share that matched before other views were asked
  int views_without = 0;  ///< views that have no neighbour to match with
  OpenSpace open;
  std::vector<Skip> skips;
};

struct DenseDepth {
  std::vector<DepthMap> maps;  ///< one per view, in the unit of the model's world frame
  DepthReport report;
};

/// Dense depth of posed views by multi-view PatchMatch stereo (Bleyer et al. 2011; Galliani et al.
/// 2015; Schoenberger et al. 2016), coarse to fine, with a check between views. `images`: one per
/// view, 8-bit gray or BGR, at its camera's size. The model's points seed the search; without any,
/// it starts from random planes alone. Depth of the open sky is infinite (DepthOptions::ground).
/// Same seed, same result, for any number of threads. Errors: an option out of its range (usage),
/// images that don't fit the views (input), no two views that look at one place from different
/// directions (quality), cancelled.
Result<DenseDepth> dense_depth(const Reconstruction& model, const std::vector<cv::Mat>& images,
                               const DepthOptions& options, const Progress& progress);

}  // namespace orbitfuse::depth
