// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/scene_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/patch_matching.hpp"
#include "recon/alignment/whole_view.hpp"
#include "recon/poses/cross_modal/orbit_refinement.hpp"
#include "recon/poses/cross_modal/painted_scene.hpp"
#include "recon/poses/cross_modal/scene_views.hpp"
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
/// of 24, a focal length 1.3 times too long fewer than half (docs/benchmarks/known_poses.md).
constexpr double believed_share = 0.5, mended_share = 0.75;
/// Where the views' edges place them: right poses of seven scenes 0.70 degrees aside in the median
/// at most, of a focal length 2 % too long 1.1 and more, 5 % too long 2.6, of a world turned by 5
/// degrees or a tenth too large 4.2.
constexpr double precise_apart_deg = 0.9, believed_apart_deg = 2;
/// Of the median view's correlation: of right views 0.61 and more, of wrong ones whose own image is
/// the best all the same 0.26 at most.
constexpr double least_correlation_share = 0.45;

constexpr int render_width_px = 160;  ///< made of keyframes, which costs a hundredth of a render
constexpr int shift_px = 3;           ///< of such a render: half a degree of a narrow lens

Camera narrow(const Camera& camera) {
  return camera.scaled_to(render_width_px,
                          std::max(1, camera.height * render_width_px / camera.width));
}

double turn_deg(const PosedView& a, const PosedView& b) {
  const double w = std::abs(a.cam_from_world.rotation.dot(b.cam_from_world.rotation));
  return 2 * std::acos(std::min(w, 1.0)) * 180 / EIGEN_PI;
}

/// The images of views that are turned away from one, spread evenly over them.
std::vector<std::size_t> controls_of(const std::vector<PosedView>& views, std::size_t view) {
  std::vector<std::size_t> turned;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (i != view && turn_deg(views[i], views[view]) >= control_turn_deg) turned.push_back(i);
  if (turned.size() <= most_controls) return turned;
  std::vector<std::size_t> chosen;
  for (std::size_t c = 0; c < most_controls; ++c)
    chosen.push_back(turned[c * turned.size() / most_controls]);
  return chosen;
}

/// Fewer images than that are no choice.
constexpr std::size_t least_controls = 3;

/// How many other images fit the render from a view's place as well as its own does.
Result<int> rivals(const SceneRenderer& scene, const std::vector<cv::Mat>& fields,
                   const std::vector<PosedView>& views, std::size_t view) {
  ORBITFUSE_ASSIGN(const SceneRender seen,
                   scene(narrow(views[view].camera), views[view].cam_from_world));
  const cv::Mat edges = rendered_edges(seen);
  const auto fit = [&](std::size_t image) {
    return fields[image].size() == edges.size()
               ? match_whole(edges, fields[image], shift_px).correlation
               : -1.0;
  };
  const double own = fit(view);
  int as_good = 0;
  for (const std::size_t other : controls_of(views, view)) as_good += fit(other) >= own ? 1 : 0;
  return as_good;
}

/// Of each view, or each `every`th, whether its own image is the best one for its place. A place
/// that shows nothing is none.
Result<std::vector<bool>> own_is_best(const SceneRenderer& scene,
                                      const std::vector<cv::Mat>& fields,
                                      const std::vector<PosedView>& views, const Progress& progress,
                                      std::size_t every = 1) {
  std::vector<bool> best;
  for (std::size_t v = 0; v < views.size(); v += every) {
    ORBITFUSE_TRY(progress.check("poses.thermal"));
    ORBITFUSE_ASSIGN(const int as_good, rivals(scene, fields, views, v));
    best.push_back(as_good == 0);
  }
  return best;
}

bool comparable(const std::vector<PosedView>& views) {
  std::size_t with_controls = 0;
  for (std::size_t v = 0; v < views.size(); ++v)
    with_controls += controls_of(views, v).size() >= least_controls ? 1 : 0;
  return 2 * with_controls >= views.size();
}

Result<double> median_apart_deg(const SceneRenderer& scene, const OrbitViews& orbit,
                                const std::vector<PosedView>& views, const Progress& progress) {
  RenderAlignmentOptions alone;
  alone.focal_relative_sigma = 0;
  alone.rounds = wide_rounds();
  ORBITFUSE_ASSIGN(const Fit placed,
                   align_with_renders(scene, orbit.images, views, alone, progress));
  std::vector<double> apart;
  for (std::size_t v = 0; v < views.size(); ++v)
    apart.push_back(apart_deg(orbit, views[v].cam_from_world, placed.views[v].view.cam_from_world));
  return median(apart);
}

double share_of(const std::vector<bool>& best) {
  return static_cast<double>(std::count(best.begin(), best.end(), true)) /
         static_cast<double>(best.size());
}

/// Of each image with what those views paint whose own image is the best.
Result<std::vector<std::optional<double>>> correlations(const SceneRenderer& scene,
                                                        const std::vector<cv::Mat>& images,
                                                        const std::vector<PosedView>& views,
                                                        const std::vector<bool>& best,
                                                        const Progress& progress) {
  PaintedSceneOptions painting;
  painting.width_px = render_width_px;
  painting.min_turn_deg = 8;
  std::vector<PosedView> painters;
  std::vector<cv::Mat> painted_images;
  for (std::size_t v = 0; v < views.size(); ++v)
    if (best[v]) painters.push_back(views[v]), painted_images.push_back(images[v]);
  ORBITFUSE_ASSIGN(const SceneRenderer painted,
                   painted_scene(scene, painters, painted_images, painting, progress));
  std::vector<std::optional<double>> result;
  for (std::size_t v = 0; v < views.size(); ++v) {
    ORBITFUSE_ASSIGN(const auto correlation, correlation_with(painted, images[v], views[v]));
    result.push_back(correlation);
  }
  return result;
}

void name_wrong(const std::vector<bool>& best,
                const std::vector<std::optional<double>>& correlations, SceneJudgement& judged) {
  std::vector<double> known;
  for (const auto& correlation : correlations)
    if (correlation) known.push_back(*correlation);
  judged.median_correlation = median(known);
  for (std::size_t v = 0; v < best.size(); ++v) {
    const bool unlike =
        !(correlations[v].value_or(-1) >= least_correlation_share * judged.median_correlation);
    const std::string like =
        correlations[v] ? fmt::format(
                              "its image correlates with what the others measured there at {:.2f}, "
                              "the median view's at {:.2f}",
                              *correlations[v], judged.median_correlation)
                        : "nothing that the others measured is seen from there";
    if (best[v] && !unlike) continue;
    if (best[v])
      judged.doubtful.emplace_back(v, like + ": look at its known pose");
    else if (!unlike)
      judged.doubtful.emplace_back(
          v, "another view's image fits the scene from its known pose better: look at that");
    else
      judged.wrong.emplace_back(
          v, "another view's image fits the scene from its known pose better, and " + like +
                 ": correct it");
  }
}

}  // namespace

Result<SceneJudgement> judge_by_scene(const SceneRenderer& scene, const OrbitViews& orbit,
                                      const std::vector<PosedView>& views,
                                      const Progress& progress) {
  const TraceSpan span("check known poses");
  SceneJudgement judged;
  if (views.size() < least_views_to_judge || !comparable(views)) return judged;
  judged.views = static_cast<int>(views.size());
  std::vector<cv::Mat> fields;
  for (std::size_t v = 0; v < views.size(); ++v)
    fields.push_back(edges_at(orbit.images[v], narrow(views[v].camera)));
  ORBITFUSE_ASSIGN(const std::vector<bool> best, own_is_best(scene, fields, views, progress));
  judged.best_of_all = static_cast<int>(std::count(best.begin(), best.end(), true));
  if (share_of(best) < believed_share) {
    judged.contradicted = true;
    const std::size_t every = std::max<std::size_t>(1, views.size() / views_to_try_slips);
    const PoseFit fit = [&](const std::vector<PosedView>& mended) -> Result<double> {
      ORBITFUSE_ASSIGN(const std::vector<bool> then,
                       own_is_best(scene, fields, mended, progress, every));
      return share_of(then);
    };
    ORBITFUSE_ASSIGN(judged.slip, likeliest_slip(views, fit));
    if (judged.slip && judged.slip->fit < mended_share) judged.slip.reset();
    return judged;
  }
  ORBITFUSE_ASSIGN(judged.median_apart_deg, median_apart_deg(scene, orbit, views, progress));
  ORBITFUSE_ASSIGN(const auto like, correlations(scene, orbit.images, views, best, progress));
  name_wrong(best, like, judged);
  judged.contradicted =
      judged.median_apart_deg > believed_apart_deg || 2 * judged.wrong.size() > views.size();
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
  if (judged.median_apart_deg > 0)
    words += fmt::format("; the views' edges place them {:.1f} deg aside in the median",
                         judged.median_apart_deg);
  return words;
}

void take(const SceneJudgement& judged, const std::vector<PosedView>& views, ModalityPoses& poses) {
  for (const auto& [view, why] : judged.wrong) {
    const std::string& name = views[view].name;
    std::erase_if(poses.reconstruction.views,
                  [&](const PosedView& posed) { return posed.name == name; });
    poses.dropped.push_back({name, why});
  }
  for (const auto& [view, why] : judged.doubtful)
    poses.doubtful.push_back({views[view].name, DoubtReason::weak_support, why});
  poses.ladder.back().posed = static_cast<int>(poses.reconstruction.views.size());
  poses.gates["posed_ratio"] = poses.posed_ratio();
}

}  // namespace

Result<std::optional<Contradiction>> check_by_scene(const Session& session,
                                                    const VisibleScene& visible,
                                                    const Progress& progress,
                                                    ModalityPoses& poses) {
  const std::optional<Contradiction> believed;
  const std::vector<PosedView> given = poses.reconstruction.views;
  const auto unchecked = [&](const std::string& why) {
    poses.skips.push_back({"check of the known thermal poses", why,
                           "whether they are these images' is only seen in the renders"});
    return believed;
  };
  if (!visible.renderer) return unchecked("there is no visible field to see them in");
  if (given.size() < least_views_to_judge) return unchecked(fmt::format("{} views", given.size()));
  progress.report({"poses.thermal", 0, 1, {}, "renders, to check the known poses"});
  std::vector<PosedView> views = given;
  OrbitViews orbit;
  orbit.canonical_from_world = canonical_from_world(visible.reconstruction.views, {});
  for (PosedView& view : views) {
    const auto frame =
        std::find_if(session.frames.begin(), session.frames.end(),
                     [&](const FrameRecord& record) { return record.file == view.name; });
    ORBITFUSE_ASSIGN(cv::Mat image, straight_luminance(session, *frame, view.camera));
    orbit.images.push_back(std::move(image));
    view.camera = view.camera.without_distortion();
  }
  ORBITFUSE_ASSIGN(const SceneRenderer scene,
                   scene_of(visible, orbit.canonical_from_world, progress));
  ORBITFUSE_ASSIGN(const SceneJudgement judged, judge_by_scene(scene, orbit, views, progress));
  poses.gates["known_poses_checked"] = judged.views;
  if (judged.views == 0) return unchecked("all views look the same way");
  poses.gates["known_poses_best_of_all"] = judged.best_of_all;
  poses.gates["known_poses_apart_deg"] = judged.median_apart_deg;
  const std::string figures = words_of(judged);
  if (judged.contradicted)
    return std::optional(Contradiction{figures, judged.slip ? judged.slip->true_focal : 1});
  if (judged.median_apart_deg > precise_apart_deg)
    poses.warnings.push_back(
        fmt::format("the known thermal poses are imprecise: their edges place the views {:.1f} deg "
                    "aside in the median, of right poses half a degree",
                    judged.median_apart_deg));
  poses.ladder.back().why += "; " + figures;
  take(judged, given, poses);
  return believed;
}

}  // namespace orbitfuse
