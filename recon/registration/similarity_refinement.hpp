// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "recon/alignment/render_alignment.hpp"

// Two reconstructions that point clouds have brought together are off by what the clouds' edges are
// blurred by. The thermal images themselves say more: seen from where the similarity puts their
// cameras, the visible scene's rendered edges must fall on theirs, in all views with one
// similarity.
namespace orbitfuse {

struct SimilarityRefinement {
  Similarity3d visible_from_thermal;
  double agreement_before = 0, agreement_after = 0;  ///< of rendered edges with the images', -1..1
  int matches_before = 0, matches_after = 0;         ///< patches within 2 px
  /// The images are explained better than before; if not, the similarity is the one given.
  bool improved = false;
  /// Images were given but don't see the final answer: its edges don't agree with theirs at all, or
  /// too few patches are in place to tell a right one by. False where none were given.
  bool unseen = false;
  int starts = 1;           ///< tried from
  std::vector<Skip> skips;  ///< starts not tried, and why
};

/// A thermal view and its recorded image as its camera without distortion would have taken them:
/// the renders that it is compared with are straight. Both stay where there is none. Error: input
/// (the image isn't of its camera's size).
Status straighten(cv::Mat& image, PosedView& view);

/// `images`: CV_32FC1 of `thermal` views, straight (see straighten()), in their own world. Errors:
/// input (counts differ), the renderer's, cancelled.
Result<SimilarityRefinement> refine_similarity(const SceneRenderer& visible,
                                               const std::vector<cv::Mat>& images,
                                               const std::vector<PosedView>& thermal,
                                               const Similarity3d& visible_from_thermal,
                                               const std::vector<RenderRound>& rounds,
                                               const Progress& progress);

/// The same from a `start` found elsewhere, judged against `visible_from_thermal`, which stays if
/// that explains the images better.
Result<SimilarityRefinement> refine_similarity(
    const SceneRenderer& visible, const std::vector<cv::Mat>& images,
    const std::vector<PosedView>& thermal, const Similarity3d& visible_from_thermal,
    const Similarity3d& start, const std::vector<RenderRound>& rounds, const Progress& progress);

/// How well the visible scene, seen from where the similarity puts the thermal cameras, explains
/// their images: the mean, over at most eight views, of the normalised correlation of all edges at
/// its best shift, 0..1. Tells placements apart that the clouds cannot (flips); their last degrees
/// are refine_similarity's. Errors as there.
Result<double> similarity_support(const SceneRenderer& visible, const std::vector<cv::Mat>& images,
                                  const std::vector<PosedView>& thermal,
                                  const Similarity3d& visible_from_thermal,
                                  const Progress& progress);

/// From several degrees and a tenth of the distance off.
inline std::vector<RenderRound> similarity_rounds() {
  return {{.width_px = 160, .search_px = 30, .patch_search_px = 14, .patch_radius_px = 22},
          {.width_px = 160, .search_px = 20, .patch_search_px = 12, .patch_radius_px = 18},
          {.width_px = 160, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 12},
          {.width_px = 256, .search_px = 8, .patch_search_px = 8, .patch_radius_px = 12},
          {.width_px = 320, .search_px = 6, .patch_search_px = 7, .patch_radius_px = 12}};
}

}  // namespace orbitfuse
