// SPDX-License-Identifier: BSD-3-Clause
#include "recon/alignment/render_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "core/geometry/narrowed.hpp"
#include "core/system/parallel.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/patch_residual.hpp"
#include "recon/alignment/pose_bundle.hpp"
#include "recon/alignment/pose_correction.hpp"

namespace orbitfuse {
namespace {

struct ViewMatches {
  std::vector<PatchMatch> matches;
};

/// The robust scale is lowered step by step, from where patches are to where they fit.
constexpr double robust_scales_px[] = {8, 4, 2, 1};

/// Corrections of all views given, and what their common focal length is scaled by, as a logarithm.
double solve(const std::vector<const ViewMatches*>& views, const Camera& camera,
             const ValuePrior& log_focal, const std::vector<PoseCorrection*>& corrections) {
  PoseBundle bundle(camera, views.size());
  for (std::size_t i = 0; i < views.size(); ++i)
    for (const PatchMatch& match : views[i]->matches) bundle.add(i, match, match.score);
  constexpr int iterations = 25;
  for (const double scale_px : robust_scales_px)
    bundle.solve({log_focal, {}}, {scale_px, 1}, iterations);
  for (std::size_t i = 0; i < views.size(); ++i) *corrections[i] = bundle.corrections()[i];
  return bundle.log_focal();
}

double solve_together(const std::vector<ViewMatches>& views, const Camera& camera,
                      const ValuePrior& prior, std::vector<PoseCorrection>& corrections) {
  std::vector<const ViewMatches*> all;
  std::vector<PoseCorrection*> found;
  for (const ViewMatches& view : views) all.push_back(&view);
  for (PoseCorrection& correction : corrections) found.push_back(&correction);
  return solve(all, camera, prior, found);
}

/// The corrections, with the lens as it is: nothing is shared.
void solve_each(const std::vector<ViewMatches>& views, const Camera& camera,
                std::vector<PoseCorrection>& corrections) {
  parallel_for(static_cast<int>(views.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    if (!views[i].matches.empty()) solve({&views[i]}, camera, {0, 0}, {&corrections[i]});
  });
}

/// Orientation fields of the images at one width: many starts share an image, and rounds a width.
class ImageFields {
 public:
  void prepare(const std::vector<cv::Mat>& images, const Camera& camera) {
    if (camera.width != width_) fields_.clear();
    width_ = camera.width;
    std::vector<std::pair<const cv::Mat*, cv::Mat*>> missing;
    for (const cv::Mat& image : images) {
      const auto [field, added] = fields_.try_emplace(image.data);
      if (added) missing.emplace_back(&image, &field->second);
    }
    parallel_for(static_cast<int>(missing.size()), [&](int index) {
      const auto& [image, field] = missing[static_cast<std::size_t>(index)];
      *field = edges_at(*image, camera);
    });
  }
  const cv::Mat& of(const cv::Mat& image) const { return fields_.at(image.data); }

 private:
  int width_ = 0;
  std::map<const uchar*, cv::Mat> fields_;  ///< by the image's samples
};

}  // namespace

std::vector<PosedView> RenderAlignment::poses() const {
  std::vector<PosedView> poses;
  for (const RenderAlignedView& v : views) poses.push_back(v.view);
  return poses;
}

Result<RenderAlignment> align_with_renders(const SceneRenderer& renderer,
                                           const std::vector<cv::Mat>& images,
                                           const std::vector<PosedView>& views,
                                           const RenderAlignmentOptions& options,
                                           const Progress& progress) {
  RenderAlignment result;
  for (const PosedView& view : views) result.views.push_back({view, 0, 0, 0, {}, {}});
  if (views.empty()) return result;
  double focal = views.front().camera.fx;
  const double prior_focal = options.prior_focal_px.value_or(focal);
  const double aspect = views.front().camera.fy / focal;  // of a pixel
  ImageFields fields;
  for (const RenderRound& round : options.rounds) {
    std::vector<ViewMatches> matched(views.size());
    const Camera full = result.views.front().view.camera;
    Camera camera = narrowed_to(full, round.width_px);
    const Camera seen_by = camera.without_distortion();
    std::vector<SceneRender> renders;
    for (std::size_t i = 0; i < views.size(); ++i) {
      ORBITFUSE_TRY(progress.check("poses.thermal"));
      ORBITFUSE_ASSIGN(SceneRender render, renderer(seen_by, result.views[i].view.cam_from_world));
      renders.push_back(std::move(render));
    }
    const PatchMatchOptions matching{round.search_px, round.patch_search_px, round.patch_radius_px,
                                     round.patch_spacing_px};
    fields.prepare(images, camera);
    parallel_for(static_cast<int>(views.size()), [&](int index) {
      const auto i = static_cast<std::size_t>(index);
      const cv::Mat edges = rendered_edges(renders[i]);
      const cv::Mat& field = fields.of(images[i]);
      matched[i].matches = match_patches(renders[i], edges, seen_by, field, matching);
      result.views[i].agreement = edge_agreement(edges, field);
    });
    std::vector<PoseCorrection> corrections(views.size(), PoseCorrection{});
    double log_focal = 0;
    if (options.focal_relative_sigma > 0)
      log_focal = solve_together(matched, seen_by,
                                 {std::log(prior_focal / focal), options.focal_relative_sigma},
                                 corrections);
    else
      solve_each(matched, seen_by, corrections);
    focal *= std::exp(log_focal);
    for (std::size_t i = 0; i < views.size(); ++i) {
      RenderAlignedView& view = result.views[i];
      // Too few patches would turn the camera anywhere; it stays where it is for this round.
      constexpr std::size_t least_matches = 12;
      if (matched[i].matches.size() < least_matches) corrections[i] = {};
      const PatchFit fit =
          patch_fit(matched[i].matches, seen_by, CorrectedPose(corrections[i]), log_focal);
      view.matches = fit.matches;
      view.median_px = fit.median_px;
      view.view.cam_from_world = rigid_of(corrections[i]) * view.view.cam_from_world;
    }
    for (RenderAlignedView& view : result.views)
      view.view.camera.fx = focal, view.view.camera.fy = focal * aspect;
  }
  result.focal_px = focal;
  return result;
}

}  // namespace orbitfuse
