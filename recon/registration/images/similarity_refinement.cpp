// SPDX-License-Identifier: BSD-3-Clause
#include "recon/registration/similarity_refinement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/geometry/narrowed.hpp"
#include "core/image/undistorted.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/whole_view.hpp"
#include "recon/registration/images/similarity_round.hpp"

namespace orbitfuse {
namespace {

Status one_image_each(const std::vector<cv::Mat>& images, const std::vector<PosedView>& thermal) {
  if (images.size() == thermal.size()) return {};
  return fail(ErrorKind::input, "similarity refinement",
              fmt::format("{} images for {} views", images.size(), thermal.size()),
              "give one image a view");
}

/// Whether the images say anything of the answer that stays.
bool sees_answer(const SimilarityRefinement& r) {
  const double agreement = r.improved ? r.agreement_after : r.agreement_before;
  const int in_place = r.improved ? r.matches_after : r.matches_before;
  return agreement > 0 && in_place >= static_cast<int>(fewest_patches);
}

}  // namespace

Status straighten(cv::Mat& image, PosedView& view) {
  ORBITFUSE_ASSIGN(image, recorded_straight(image, view.camera, view.name));
  view.camera = view.camera.without_distortion();
  return {};
}

Result<SimilarityRefinement> refine_similarity(const SceneRenderer& visible,
                                               const std::vector<cv::Mat>& images,
                                               const std::vector<PosedView>& thermal,
                                               const Similarity3d& visible_from_thermal,
                                               const std::vector<RenderRound>& rounds,
                                               const Progress& progress) {
  return refine_similarity(visible, images, thermal, visible_from_thermal, visible_from_thermal,
                           rounds, progress);
}

Result<SimilarityRefinement> refine_similarity(
    const SceneRenderer& visible, const std::vector<cv::Mat>& images,
    const std::vector<PosedView>& thermal, const Similarity3d& visible_from_thermal,
    const Similarity3d& start, const std::vector<RenderRound>& rounds, const Progress& progress) {
  ORBITFUSE_TRY(one_image_each(images, thermal));
  SimilarityRefinement result;
  result.visible_from_thermal = visible_from_thermal;
  if (thermal.empty()) return result;
  Similarity3d current = start;
  for (const RenderRound& round : rounds) {
    ORBITFUSE_ASSIGN(const SimilarityRound seen,
                     match_scene(visible, images, thermal, current, round, progress));
    if (seen.patches.size() < fewest_patches) break;
    current = agreed_similarity(seen.patches, current.inverse()).inverse();
  }
  // Both judged alike: the same last round, without a search of its own.
  const RenderRound judge{
      .width_px = 256, .search_px = 3, .patch_search_px = 4, .patch_radius_px = 10};
  ORBITFUSE_ASSIGN(const SimilarityRound before,
                   match_scene(visible, images, thermal, visible_from_thermal, judge, progress));
  ORBITFUSE_ASSIGN(const SimilarityRound after,
                   match_scene(visible, images, thermal, current, judge, progress));
  result.agreement_before = before.agreement;
  result.agreement_after = after.agreement;
  result.matches_before = before.matches(visible_from_thermal.inverse());
  result.matches_after = after.matches(current.inverse());
  result.improved = current.is_finite() && current.scale > 0 &&
                    result.agreement_after > result.agreement_before &&
                    result.matches_after > result.matches_before;
  result.unseen = !sees_answer(result);
  if (result.unseen) result.improved = false;  // few patches more of few
  if (result.improved) result.visible_from_thermal = current;
  return result;
}

Result<double> similarity_support(const SceneRenderer& visible, const std::vector<cv::Mat>& images,
                                  const std::vector<PosedView>& thermal,
                                  const Similarity3d& visible_from_thermal,
                                  const Progress& progress) {
  constexpr int render_width_px = 160, reach_px = 16;
  constexpr std::size_t most_views = 8;
  ORBITFUSE_TRY(one_image_each(images, thermal));
  if (thermal.empty()) return 0.0;
  const std::size_t count = std::min(most_views, thermal.size());
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    ORBITFUSE_TRY(progress.check("register"));
    const PosedView& view = thermal[k * thermal.size() / count];
    const Camera camera = narrowed_to(view.camera, render_width_px).without_distortion();
    ORBITFUSE_ASSIGN(const SceneRender seen,
                     visible(camera, rebase(view.cam_from_world, visible_from_thermal)));
    const cv::Mat field = edges_at(images[k * thermal.size() / count], camera);
    const WholeMatch match = match_whole(rendered_edges(seen), field, reach_px);
    sum += std::max(0.0, match.correlation);
  }
  return sum / static_cast<double>(count);
}

}  // namespace orbitfuse
