// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "recon/poses/sfm/feature_graph.hpp"

// A model of two parts that few points join is sure within each part and knows little of how they
// lie to each other: the points that join them may be a handful of false matches, which nothing
// else contradicts, and every residual is small. Points of two views hold a pair at a scale of its
// own only: a joint is as firm as those of three and more, too.
namespace orbitfuse {

/// Where a model comes apart most easily.
struct Joint {
  std::vector<char> beyond;  ///< per view: on the side of fewer views
  int views_beyond = 0;
  int points = 0;          ///< that both sides see
  int views_of_point = 2;  ///< counted are the points that at least so many views see
  double share = 1;  ///< of what the median view sees: a chain's links are no weaker for its length

  /// Right models of seventeen sessions have 0.30 and more of all points, those of forty have 0.29
  /// and more of the points of three views. `fox`, whose second walk was 28 % of the extent off
  /// with each half right in itself, had 0.13 of all; `five_drums` 93, cut off after 21 photos and
  /// bent by 3.5 %, had 0.39 of all and 0.08 of those of three (docs/notes/poses_visible.md).
  bool loose() const { return share < 0.2; }
};

/// The split of the views, three and more on each side, that the fewest points join,
/// among those in the order of the three slowest modes of the graph of common points (spectral
/// partitioning: Shi and Malik, Normalized cuts and image segmentation, 2000), of all points or of
/// those of three views, whichever is the smaller share. No split, share 1: less than six views, or
/// more than 1000, whose dense graph would cost more than it tells.
Joint weakest_joint(const Reconstruction& model);

/// Pairs across the joint whose features look most alike: of each view its likeliest partners. Few,
/// because to verify one takes COLMAP half a second. Looking takes up to 20 s. Errors: cancelled.
Result<std::vector<ViewPair>> likely_pairs_across(const FeatureGraph& graph,
                                                  const Reconstruction& model, const Joint& joint,
                                                  const Progress& progress);

}  // namespace orbitfuse
