// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/poses/estimate/model_selection.hpp"
#include "recon/poses/sfm/bundle_adjustment.hpp"
#include "recon/poses/sfm/feature_graph.hpp"

// A posed model on more observations, or on better ones: what the last steps of the ladder adjust
// again. Not adjusted yet; docs/notes/poses_visible.md has the figures of the constants.
namespace orbitfuse {

struct RefinedTracks {
  std::optional<Reconstruction> model;  ///< none where it is not worth an adjustment
  std::string found;                    ///< figures, in words; none where it was not looked for
};

/// On the matches along the epipolar lines of its own poses; not looked for where it has plenty.
RefinedTracks rematched_model(const FeatureGraph& graph, const Reconstruction& model);

/// On observations that the images themselves place, one image a view. None where too few do, where
/// there are too many, and where views are in doubt: what is found where their own poses have it
/// would lift that. Errors: cancelled.
Result<RefinedTracks> aligned_model(const Reconstruction& model, const std::vector<cv::Mat>& images,
                                    const Progress& progress);

/// For what patches place: they lie within a tenth of a pixel, descriptors' centres within a half.
BundleOptions aligned_bundle();

/// As many views, on as good as all of the matches.
ModelSelection::Better explains_as_much(const FeatureGraph& graph);

/// No view in doubt, and no two parts that hang together loosely.
bool holds_all_views(const Reconstruction& model);

}  // namespace orbitfuse
