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
#include "recon/poses/sfm/tracks.hpp"

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

/// Of the images that features were found in: a proposed match that misses the epipolar lines of
/// poses by less is confirmed. The model knows better than two-view geometry which matches hold.
inline constexpr double confirming_px = 3;

/// Where poses confirm more matches of a pair than two-view geometry verified, they take their
/// place.
void add_confirmed(FeatureGraph& graph, PairMatches confirmed);

/// The verified matches as points of the posed views.
Reconstruction triangulated(const FeatureGraph& graph, const PosedFrames& posed);

/// On all matches that are verified, or that the model's poses confirm.
Reconstruction triangulated_again(FeatureGraph graph, const Reconstruction& model);

/// How far a view of both models has moved, at most, when one is laid over the other as a whole: a
/// share of the RMS distance of the centers from their middle. 0 for less than three views,
/// and where they stand on a line: nothing lays these over each other.
double farthest_move(const Reconstruction& model, const Reconstruction& before);

/// Below it nothing is gained: triangulated again, models of four scenes whose views stood right
/// moved by 0.12 to 0.68 %, those with views 0.5, 2.1 and 6.6 % of the extent off by 0.96, 2.05 and
/// 1.33 (docs/notes/poses_visible.md).
inline constexpr double least_move = 0.005;

/// For what patches place: they lie within a tenth of a pixel, descriptors' centres within a half.
BundleOptions aligned_bundle();

/// As many views, on as good as all of the matches.
ModelSelection::Better explains_as_much(const FeatureGraph& graph);

/// No view in doubt, and no two parts that hang together loosely.
bool holds_all_views(const Reconstruction& model);

}  // namespace orbitfuse
