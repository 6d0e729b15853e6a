// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/registration/similarity_refinement.hpp"

// Patches bring a similarity home from a few degrees off; from farther they settle on the next
// place that looks alike, with fewer of them in place. Where clouds overlap little they leave more
// than that open, so that the search starts from several places round their answer and lets the
// images choose.
namespace orbitfuse {

struct SimilaritySearchOptions {
  /// How far from the clouds' answer each start is turned, about each axis of the visible world,
  /// both ways.
  double turn_deg = 5;
  /// How much larger and smaller the scene is tried. Shifts need no starts of their own: each
  /// view's first search reaches a fifth of its width.
  double growth = 0.05;
  /// False: the clouds call their own answer ambiguous, which no single start is trusted on.
  bool clouds_decide = false;
  /// Share of patches in place from which the clouds' answer counts as confirmed by the images, if
  /// these also leave it within half a step; a shift by `growth` of the scene's diameter is one.
  /// Necessary, not sufficient: right answers have 0.85 and more, but a wrong one had 0.81
  /// (docs/notes/poses.md).
  double decisive_share = 0.8;
  /// Of all views, spread evenly: enough to tell starts apart. The last rounds take all.
  int most_views = 8;
  /// Starts that are followed beyond the first two rounds.
  int finalists = 3;

  /// Usage error naming the field.
  Status validate() const;
};

/// refine_similarity from the best of several starts; from the clouds' answer alone where that is
/// decisive (then named in `skips`). `images` as there. Errors: usage, those of refine_similarity.
Result<SimilarityRefinement> search_similarity(const SceneRenderer& visible,
                                               const std::vector<cv::Mat>& images,
                                               const std::vector<PosedView>& thermal,
                                               const Similarity3d& visible_from_thermal,
                                               const SimilaritySearchOptions& options,
                                               const Progress& progress);

}  // namespace orbitfuse
