// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/scene_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/narrowed.hpp"
#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/whole_view.hpp"
#include "recon/poses/cross_modal/orbit_refinement.hpp"
#include "recon/poses/cross_modal/painted_scene.hpp"
#include "recon/poses/scene_views.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Images that a view's own is compared with: more would say the same.
constexpr std::size_t most_controls = 24;
/// So many tell which mistake it is.
constexpr std::size_t views_to_try_slips = 12;
/// A view turned by less shows nearly the same.
constexpr double control_turn_deg = 10;
/// Right poses of seven scenes make every view's own image the best one, poses in another world one
/// of 24, a focal length 1.3 times too long fewer than half (docs/benchmarks/input/known_poses.md).
constexpr double believed_share = 0.5, explained_share = 0.75;
/// Where the views' edges place them: right poses of seven scenes 0.70 degrees aside in the median
/// at most, of a focal length 2 % too long 1.1 and more, 5 % too long 2.6, of a world turned by 5
/// degrees or a tenth too large 4.2.
constexpr double precise_apart_deg = 0.9, believed_apart_deg = 2;
/// Of the median view's correlation: of right views 0.61 and more, of wrong ones whose own image is
/// the best all the same 0.26 at most.
constexpr double least_correlation_share = 0.45;

constexpr int render_width_px = 160;  ///< made of keyframes, which costs a hundredth of a render
constexpr int shift_px = 3;           ///< of such a render: half a degree of a narrow lens

/// Patches without which alignment leaves a view where it was.
constexpr int least_matches = 12;

/// The images of views that are turned away from one, spread evenly over them; those of another
/// shape can't be laid over its render.
std::vector<std::size_t> controls_of(const std::vector<cv::Mat>& fields,
                                     const std::vector<PosedView>& views, std::size_t view) {
  std::vector<std::size_t> turned;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (i != view && fields[i].size() == fields[view].size() &&
        rotation_angle_deg(views[i].cam_from_world.rotation, views[view].cam_from_world.rotation) >=
            control_turn_deg)
      turned.push_back(i);
  if (turned.size() <= most_controls) return turned;
  std::vector<std::size_t> chosen;
  for (std::size_t c = 0; c < most_controls; ++c)
    chosen.push_back(turned[c * turned.size() / most_controls]);
  return chosen;
}

/// Fewer images than that are no choice.
constexpr std::size_t least_controls = 3;

/// Whether a view's own image fits the render from its place better than others do: a place that
/// shows nothing fits none. Nothing where there are too few others to choose from.
Result<std::optional<bool>> own_is_best(const SceneRenderer& scene,
                                        const std::vector<cv::Mat>& fields,
                                        const std::vector<PosedView>& views, std::size_t view) {
  const std::vector<std::size_t> controls = controls_of(fields, views, view);
  if (controls.size() < least_controls) return std::optional<bool>();
  ORBITFUSE_ASSIGN(const SceneRender seen, scene(narrowed_to(views[view].camera, render_width_px),
                                                 views[view].cam_from_world));
  const cv::Mat edges = rendered_edges(seen);
  const auto fit = [&](std::size_t image) {
    return fields[image].size() == edges.size()
               ? match_whole(edges, fields[image], shift_px).correlation
               : -1.0;
  };
  const double own = fit(view);
  return std::optional(std::none_of(controls.begin(), controls.end(),
                                    [&](std::size_t other) { return fit(other) >= own; }));
}

using Ranks = std::vector<std::optional<bool>>;

/// Of each view, or each `every`th.
Result<Ranks> ranks_of(const SceneRenderer& scene, const std::vector<cv::Mat>& fields,
                       const std::vector<PosedView>& views, const Progress& progress,
                       std::size_t every = 1) {
  Ranks ranks;
  for (std::size_t v = 0; v < views.size(); v += every) {
    ORBITFUSE_TRY(progress.check("poses.thermal"));
    ORBITFUSE_ASSIGN(const std::optional<bool> best, own_is_best(scene, fields, views, v));
    ranks.push_back(best);
  }
  return ranks;
}

std::ptrdiff_t judged_among(const Ranks& ranks) {
  return std::count_if(ranks.begin(), ranks.end(), [](const auto& r) { return r.has_value(); });
}
std::ptrdiff_t best_among(const Ranks& ranks) {
  return std::count(ranks.begin(), ranks.end(), std::optional(true));
}
double share_best(const Ranks& ranks) {
  return static_cast<double>(best_among(ranks)) /
         static_cast<double>(std::max<std::ptrdiff_t>(judged_among(ranks), 1));
}

/// Views that one lens took: alignment takes the first one's for all.
std::vector<std::vector<std::size_t>> by_lens(const std::vector<PosedView>& views) {
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto same = std::find_if(groups.begin(), groups.end(), [&](const auto& group) {
      return views[group.front()].camera == views[v].camera;
    });
    if (same == groups.end())
      groups.push_back({v});
    else
      same->push_back(v);
  }
  return groups;
}

/// Nothing where alignment finds too little in most views.
Result<std::optional<double>> median_apart_deg(const SceneRenderer& scene, const OrbitViews& orbit,
                                               const std::vector<PosedView>& views,
                                               const Progress& progress) {
  RenderAlignmentOptions alone;
  alone.focal_relative_sigma = 0;
  alone.rounds = wide_rounds();
  std::vector<double> apart;
  for (const std::vector<std::size_t>& group : by_lens(views)) {
    std::vector<cv::Mat> images;
    std::vector<PosedView> of_group;
    for (const std::size_t v : group)
      images.push_back(orbit.images[v]), of_group.push_back(views[v]);
    ORBITFUSE_ASSIGN(const Fit placed,
                     align_with_renders(scene, images, of_group, alone, progress));
    for (std::size_t i = 0; i < group.size(); ++i)
      if (placed.views[i].matches >= least_matches)
        apart.push_back(
            apart_deg(orbit, of_group[i].cam_from_world, placed.views[i].view.cam_from_world));
  }
  if (2 * apart.size() < views.size()) return std::optional<double>();
  return std::optional(median(apart));
}

/// Of each image with what those views paint whose own image is the best.
Result<std::vector<std::optional<double>>> correlations(const SceneRenderer& scene,
                                                        const std::vector<cv::Mat>& images,
                                                        const std::vector<PosedView>& views,
                                                        const Ranks& ranks,
                                                        const Progress& progress) {
  PaintedSceneOptions painting;
  painting.width_px = render_width_px;
  painting.min_turn_deg = 8;
  std::vector<PosedView> painters;
  std::vector<cv::Mat> painted_images;
  for (std::size_t v = 0; v < views.size(); ++v)
    if (ranks[v].value_or(false)) painters.push_back(views[v]), painted_images.push_back(images[v]);
  ORBITFUSE_ASSIGN(const SceneRenderer painted,
                   painted_scene(scene, painters, painted_images, painting, progress));
  std::vector<std::optional<double>> result;
  for (std::size_t v = 0; v < views.size(); ++v) {
    ORBITFUSE_ASSIGN(const auto correlation, correlation_with(painted, images[v], views[v]));
    result.push_back(correlation);
  }
  return result;
}

void name_wrong(const Ranks& ranks, const std::vector<std::optional<double>>& correlations,
                SceneJudgement& judged) {
  std::vector<double> known;
  for (const auto& correlation : correlations)
    if (correlation) known.push_back(*correlation);
  judged.median_correlation = median(known);
  for (std::size_t v = 0; v < ranks.size(); ++v) {
    const bool best = ranks[v].value_or(true);
    const bool unlike = correlations[v] &&
                        !(*correlations[v] >= least_correlation_share * judged.median_correlation);
    const std::string better =
        "another view's image fits the scene from its known pose better than its own";
    const std::string like =
        unlike ? fmt::format(
                     "its image correlates with what the others measured there at {:.2f}, "
                     "the median view's at {:.2f}",
                     *correlations[v], judged.median_correlation)
               : "";
    if (!best && unlike)
      judged.wrong.emplace_back(v, better + ", and " + like + ": correct that pose");
    else if (!best || unlike)
      judged.doubtful.emplace_back(v, (best ? like : better) + ": look at that pose");
  }
}

}  // namespace

Result<SceneJudgement> judge_by_scene(const SceneRenderer& scene, const OrbitViews& orbit,
                                      const std::vector<PosedView>& views,
                                      const Progress& progress) {
  const TraceSpan span("check known poses");
  SceneJudgement judged;
  if (views.size() < least_views_to_judge) return judged;
  std::vector<cv::Mat> fields;
  for (std::size_t v = 0; v < views.size(); ++v)
    fields.push_back(edges_at(orbit.images[v], narrowed_to(views[v].camera, render_width_px)));
  ORBITFUSE_ASSIGN(const Ranks ranks, ranks_of(scene, fields, views, progress));
  const auto count = static_cast<std::ptrdiff_t>(views.size());
  if (2 * judged_among(ranks) < count) return judged;
  judged.views = static_cast<int>(judged_among(ranks));
  judged.best_of_all = static_cast<int>(best_among(ranks));
  if (share_best(ranks) < believed_share) {
    judged.contradicted = true;
    const std::size_t every = std::max<std::size_t>(1, views.size() / views_to_try_slips);
    const PoseFit fit = [&](const std::vector<PosedView>& mended) -> Result<double> {
      ORBITFUSE_ASSIGN(const Ranks then, ranks_of(scene, fields, mended, progress, every));
      return share_best(then);
    };
    ORBITFUSE_ASSIGN(judged.slip, likeliest_slip(views, fit));
    if (judged.slip && judged.slip->fit < explained_share) judged.slip.reset();
    return judged;
  }
  ORBITFUSE_ASSIGN(judged.median_apart_deg, median_apart_deg(scene, orbit, views, progress));
  ORBITFUSE_ASSIGN(const auto like, correlations(scene, orbit.images, views, ranks, progress));
  name_wrong(ranks, like, judged);
  judged.contradicted = judged.median_apart_deg.value_or(0) > believed_apart_deg ||
                        2 * judged.wrong.size() > views.size();
  return judged;
}

namespace {

std::string words_of(const SceneJudgement& judged) {
  std::string words =
      fmt::format("from {} of {} known poses the view's own image fits the visible scene best",
                  judged.best_of_all, judged.views);
  if (judged.slip)
    return words + fmt::format("; it looks as if {}: {:.0f} % would then do", judged.slip->words,
                               100 * judged.slip->fit);
  if (judged.median_apart_deg)
    words += fmt::format("; the views' edges place them {:.1f} deg aside in the median",
                         *judged.median_apart_deg);
  return words;
}

}  // namespace

Result<std::optional<Contradiction>> check_by_scene(const Session& session,
                                                    const VisibleScene& visible,
                                                    const Progress& progress,
                                                    ModalityPoses& poses) {
  const std::optional<Contradiction> believed;
  std::vector<PosedView> views = poses.reconstruction.views;
  const auto unchecked = [&](const std::string& why) {
    poses.skips.push_back({"check of the known thermal poses", why,
                           "whether they are these images' is only seen in the renders"});
    return believed;
  };
  if (!visible.renderer) return unchecked("there is no visible field to see them in");
  if (views.size() < least_views_to_judge) return unchecked(fmt::format("{} views", views.size()));
  progress.report({"poses.thermal", 0, 1, {}, "renders, to check the known poses"});
  OrbitViews orbit;
  orbit.canonical_from_world = canonical_from_world(visible.reconstruction.views, {});
  const std::vector<const FrameRecord*> frames = frames_of(session, views);
  for (std::size_t v = 0; v < views.size(); ++v) {
    PosedView& view = views[v];
    ORBITFUSE_TRY(progress.check("poses.thermal"));
    ORBITFUSE_ASSIGN(const cv::Mat image, straight_luminance(session, *frames[v], view.camera));
    view.camera = narrowed_to(view.camera.without_distortion(), render_width_px);
    orbit.images.push_back(reduced_to(image, view.camera));
  }
  ORBITFUSE_ASSIGN(const SceneRenderer scene,
                   scene_of(visible, orbit.canonical_from_world, progress));
  ORBITFUSE_ASSIGN(const SceneJudgement judged, judge_by_scene(scene, orbit, views, progress));
  poses.gates["known_poses_checked"] = judged.views;
  if (judged.views == 0) return unchecked("all views look the same way");
  poses.gates["known_poses_best_of_all"] = judged.best_of_all;
  if (judged.median_apart_deg) poses.gates["known_poses_apart_deg"] = *judged.median_apart_deg;
  const std::string figures = words_of(judged);
  if (judged.contradicted)
    return std::optional(Contradiction{figures, judged.slip ? judged.slip->true_focal : 1});
  if (judged.median_apart_deg.value_or(0) > precise_apart_deg)
    poses.warnings.push_back(
        fmt::format("the known thermal poses are imprecise: their edges place the views {:.1f} deg "
                    "aside in the median, of right poses half a degree",
                    *judged.median_apart_deg));
  poses.ladder.back().why += "; " + figures;
  take_known_verdicts(judged.wrong, judged.doubtful, DoubtReason::weak_support, poses);
  return believed;
}

}  // namespace orbitfuse
