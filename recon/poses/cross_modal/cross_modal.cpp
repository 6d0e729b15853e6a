// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/cross_modal.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/numeric/median.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/keyframe_scene.hpp"
#include "recon/alignment/luminance.hpp"
#include "recon/poses/cross_modal/edge_lines.hpp"
#include "recon/poses/cross_modal/line_alignment.hpp"
#include "recon/poses/cross_modal/orbit_selection.hpp"
#include "recon/poses/cross_modal/poses_by_lines.hpp"
#include "recon/poses/cross_modal/tracking_views.hpp"
#include "recon/poses/cross_modal/view_recovery.hpp"
#include "recon/poses/cross_modal/view_verdicts.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Frames recorded at video rate say no more than one every few degrees.
constexpr int max_tracking_frames = 96;
/// Below this share of sure views the answer as a whole is not one.
constexpr double min_sure_ratio = 0.5;
/// Views of a walk that place each other; more where nothing but their order is known.
constexpr std::size_t min_stations = 4, min_unknown_stations = 8;
/// Visible views that the scene is first rendered at: more would show the same from nearer by.
constexpr int max_keyframes = 36;

/// Lines that enough views confirm: as many witnesses as still leave a few hundred lines.
std::vector<EdgeLine> confirmed(const std::vector<EdgeLine>& lines) {
  for (const std::size_t views : {5u, 4u, 3u}) {
    std::vector<EdgeLine> kept;
    for (const EdgeLine& line : lines)
      if (line.views.size() >= views) kept.push_back(line);
    if (kept.size() >= 250 || views == 3) return kept;
  }
  return lines;
}

/// Frames recorded between the stations, posed among them; appended to `rendered`.
Status pose_tracking(const Session& session, const OrbitWork& work,
                     const std::vector<const FrameRecord*>& tracking, const SceneRenderer& renderer,
                     OrbitViews& orbit, RenderAlignment& rendered, const Progress& progress) {
  std::vector<PassedStation> passed;
  for (std::size_t i = 0; i < work.frames.size(); ++i) {
    const Rigid3d cam = rebase(rendered.views[i].view.cam_from_world, orbit.canonical_from_world);
    passed.push_back({work.frames[i]->sequence, orbit.stations[i],
                      orbit_angles(camera_center(cam)).azimuth_deg});
  }
  std::vector<std::uint64_t> sequences;
  for (const FrameRecord* frame : tracking) sequences.push_back(frame->sequence);
  const double offset_deg = station_offset_deg(orbit, rendered);
  for (const Station& station : stations_between(passed, sequences, orbit.clockwise, offset_deg))
    orbit.stations.push_back(station);
  const std::size_t first = rendered.views.size();
  for (const FrameRecord* frame : tracking) {
    ORBITFUSE_ASSIGN(cv::Mat image, read_luminance(session, *frame));
    orbit.images.push_back(std::move(image));
    RenderAlignedView view;
    view.view = rendered.views.front().view;
    view.view.name = frame->file;
    rendered.views.push_back(view);
  }
  return add_views(renderer, orbit, first, rendered, progress);
}

/// Tracking frames of the stations' own camera, in capture order.
std::vector<const FrameRecord*> tracking_of(const std::vector<const FrameRecord*>& frames,
                                            const FrameRecord& like) {
  std::vector<const FrameRecord*> tracking;
  for (const FrameRecord* frame : frames)
    if (frame->tracking && frame->device == like.device && frame->width == like.width &&
        frame->height == like.height)
      tracking.push_back(frame);
  std::stable_sort(
      tracking.begin(), tracking.end(),
      [](const FrameRecord* a, const FrameRecord* b) { return a->sequence < b->sequence; });
  return thinned(tracking, max_tracking_frames);
}

/// Frames in which the orbit is searched: those with a station, else all of one camera, in the
/// order of capture.
Result<std::vector<const FrameRecord*>> stations_of(const std::vector<const FrameRecord*>& frames) {
  std::vector<const FrameRecord*> stations, ordered;
  for (const FrameRecord* frame : frames) {
    if (frame->tracking) continue;
    if (frame->station) stations.push_back(frame);
    if (ordered.empty() ||
        (frame->device == ordered.front()->device && frame->width == ordered.front()->width &&
         frame->height == ordered.front()->height))
      ordered.push_back(frame);
  }
  if (stations.size() >= min_stations) return stations;
  std::stable_sort(ordered.begin(), ordered.end(), [](const FrameRecord* a, const FrameRecord* b) {
    return a->sequence < b->sequence;
  });
  if (ordered.size() >= min_unknown_stations) return ordered;
  return fail(
      ErrorKind::quality, "poses.thermal",
      fmt::format("{} thermal frames carry stations, {} are needed to place an orbit ({} "
                  "where only their order is known)",
                  stations.size(), min_stations, min_unknown_stations),
      "import again and say how the views were taken, e.g. --station-spacing-deg 30 --loops 2");
}

/// The ways the views may have been taken: as declared, or any even walk in their order.
std::vector<std::vector<Station>> layouts_of(const std::vector<const FrameRecord*>& stations) {
  const bool declared = std::all_of(stations.begin(), stations.end(),
                                    [](const FrameRecord* f) { return f->station.has_value(); });
  if (!declared) return station_layouts(stations.size());
  std::vector<Station> layout;
  for (const FrameRecord* frame : stations) layout.push_back(*frame->station);
  return {layout};
}

/// All that placing the stations needs, read once.
struct Evidence {
  OrbitWork work;
  std::vector<SearchView> search;
  Similarity3d canonical_from_visible;
  double similar_distance = 1;  ///< from where the thermal image shows as much as the visible one
};

Result<Evidence> gather(const Session& session, const Reconstruction& visible,
                        const std::vector<const FrameRecord*>& stations, const Progress& progress) {
  const Similarity3d canonical_from_visible = canonical_from_world(visible.views, {});
  Reconstruction canonical = visible;
  move_world(canonical, canonical_from_visible);
  ORBITFUSE_ASSIGN(const std::vector<EdgeLine> all_lines,
                   visible_edge_lines(session, canonical, {}, progress));
  const std::vector<EdgeLine> lines = confirmed(all_lines);
  if (lines.size() < 30)
    return fail(
        ErrorKind::quality, "poses.thermal",
        fmt::format("{} edges of the visible scene are confirmed by three views", lines.size()),
        "more visible views, or a scene with edges that both cameras see");
  std::vector<Eigen::Vector3d> centers;
  for (const PosedView& view : canonical.views)
    centers.push_back(camera_center(view.cam_from_world));
  Evidence evidence{{lens_of(session, *stations.front()), LineModel(lines, centers), stations, {}},
                    {},
                    canonical_from_visible,
                    1};
  const Camera& lens = evidence.work.lens.camera;
  for (const FrameRecord* frame : stations) {
    ORBITFUSE_ASSIGN(cv::Mat values, read_luminance(session, *frame));
    evidence.search.push_back({orientation_field(values, 2.0 * frame->width / 640.0), lens});
    evidence.work.images.push_back(std::move(values));
  }
  const Camera& seen = canonical.views.front().camera;
  evidence.similar_distance = lens.fx / lens.width * seen.width / seen.fx;
  return evidence;
}

Result<std::vector<OrbitHypothesis>> search(const Evidence& evidence, bool renders_decide,
                                            const Progress& progress) {
  OrbitSearchOptions options;
  options.nearest = 0.4 * evidence.similar_distance;
  options.farthest = 1.8 * evidence.similar_distance;
  options.hypotheses = renders_decide ? 4 : 2;
  ORBITFUSE_ASSIGN(const OrbitTable table,
                   tabulate_orbit(evidence.work.lines, evidence.search, options, progress));
  std::vector<OrbitHypothesis> found;
  for (const std::vector<Station>& layout : layouts_of(evidence.work.frames))
    for (OrbitHypothesis& hypothesis : search_orbit(table, layout, options))
      found.push_back(std::move(hypothesis));
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& x, const auto& y) { return x.score > y.score; });
  constexpr std::size_t most = 6;
  if (found.size() > most) found.resize(most);
  return found;
}

std::string words(const SelectedOrbit& selected) {
  std::string text;
  for (const HypothesisSupport& one : selected.supports)
    if (!one.repeats)
      text +=
          fmt::format("; start at {:.0f} deg{}, distance {:.2f}: support {:.1f}", one.offset_deg,
                      one.mirrored ? " clockwise" : "", one.radius, one.support);
  return text;
}

/// The scene for alignment: most of its views are made of a few renders.
Result<SceneRenderer> scene_of(const VisibleScene& visible,
                               const Similarity3d& canonical_from_visible,
                               const Progress& progress) {
  std::vector<PosedView> views;
  const auto count = static_cast<int>(visible.reconstruction.views.size());
  const int kept = std::min(count, max_keyframes);
  for (int i = 0; i < kept; ++i)
    views.push_back(visible.reconstruction.views[static_cast<std::size_t>(i * count / kept)]);
  const Eigen::Vector3d center = canonical_from_visible.inverse() * Eigen::Vector3d::Zero();
  return keyframe_scene(visible.renderer, views, center, {}, progress);
}

std::string loops_in_doubt(const std::vector<int>& loops) {
  std::string text;
  for (const int loop : loops)
    text += fmt::format("{}loop {} as a whole is in doubt: look at its rendered pairs",
                        text.empty() ? "" : "; ", loop);
  return text;
}

/// Places the views against renders: the hypothesis and the starts, then each view to the end, then
/// the frames recorded between the stations, then the verdicts.
Result<PlacedViews> place_by_renders(const Session& session, const VisibleScene& visible,
                                     const Evidence& evidence,
                                     const std::vector<OrbitHypothesis>& hypotheses,
                                     const std::vector<const FrameRecord*>& tracking,
                                     const Progress& progress) {
  progress.report({"poses.thermal", 2, 4, -1, "views of the scene"});
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   scene_of(visible, evidence.canonical_from_visible, progress));
  OrbitViews orbit{evidence.work.images, {}, evidence.canonical_from_visible, false};
  std::vector<PosedView> blank;
  for (const FrameRecord* frame : evidence.work.frames)
    blank.push_back({frame->file, evidence.work.lens.camera, {}});
  ORBITFUSE_ASSIGN(SelectedOrbit selected,
                   select_by_renders(renderer, orbit, blank, hypotheses, progress));
  PlacedViews placed;
  placed.method = "cross-modal, orbit prior and renders";
  placed.why = words(selected);
  RenderAlignment& rendered = selected.alignment;
  const double focal_sigma = std::max(1e-4, evidence.work.lens.focal_relative_sigma);
  progress.report({"poses.thermal", 3, 4, -1, "alignment with renders"});
  ORBITFUSE_TRY(refine_orbit(renderer, orbit, rendered, focal_sigma, progress));
  if (!tracking.empty())
    ORBITFUSE_TRY(
        pose_tracking(session, evidence.work, tracking, renderer, orbit, rendered, progress));
  ORBITFUSE_ASSIGN(const std::vector<int> doubted,
                   judge_views({renderer, orbit, progress}, rendered));
  if (!doubted.empty()) placed.warnings.push_back(loops_in_doubt(doubted));
  for (const RenderAlignedView& view : rendered.views)
    placed.views.push_back({view.view, view.verdict, view.agreement, view.median_px});
  placed.gates["focal_px"] = rendered.focal_px;
  placed.gates["loops_in_doubt"] = static_cast<double>(doubted.size());
  return placed;
}

/// The answer as a whole: enough views, and most of them sure.
Status believed(const PlacedViews& placed, const ThermalPoses& result, const LadderStep& step,
                const PoseOptions& options) {
  const double sure = result.gates.at("views_sure");
  if (result.posed_ratio() >= options.min_posed_ratio && sure >= min_sure_ratio * step.total)
    return {};
  std::string found = fmt::format("{} of {} thermal views are placed, {:.0f} of them for sure",
                                  step.posed, step.total, sure);
  for (const std::string& warning : placed.warnings) found += "; " + warning;
  std::map<std::string, int> reasons;
  for (const PlacedView& view : placed.views)
    if (!view.verdict.sure()) ++reasons[std::string(name(view.verdict.reason))];
  for (const auto& [reason, count] : reasons) found += fmt::format("; {} {}", count, reason);
  return fail(ErrorKind::quality, "poses.thermal", found,
              "say how the views were taken (import --station-spacing-deg, --loops, "
              "--thermal-focal-px), record more stations, or give known poses");
}

}  // namespace

void take_verdicts(const PlacedViews& placed, ModalityPoses& poses) {
  std::vector<double> agreements, residuals;
  for (const PlacedView& one : placed.views) {
    agreements.push_back(one.agreement);
    residuals.push_back(one.residual_px);
    if (one.verdict.confidence == Confidence::dropped) {
      poses.dropped.push_back({one.view.name, one.verdict.detail});
      continue;
    }
    if (!one.verdict.sure())
      poses.doubtful.push_back({one.view.name, one.verdict.reason, one.verdict.detail});
    poses.reconstruction.views.push_back(one.view);
  }
  poses.warnings.insert(poses.warnings.end(), placed.warnings.begin(), placed.warnings.end());
  for (const auto& [gate, value] : placed.gates) poses.gates[gate] = value;
  poses.gates["posed_ratio"] = poses.posed_ratio();
  poses.gates["edge_agreement"] = agreements.empty() ? 0 : median(agreements);
  poses.gates["edge_residual_px"] = residuals.empty() ? 0 : median(residuals);
  poses.gates["views_doubtful"] = static_cast<double>(poses.doubtful.size());
  poses.gates["views_sure"] =
      static_cast<double>(poses.reconstruction.views.size() - poses.doubtful.size());
}

Result<ThermalPoses> localise_in_visible(const Session& session, const VisibleScene& visible,
                                         const std::vector<const FrameRecord*>& frames,
                                         const PoseOptions& options, const Progress& progress,
                                         std::vector<LadderStep>& steps) {
  const auto start = std::chrono::steady_clock::now();
  const auto tell = [&](double done, const std::string& what) {
    progress.report({"poses.thermal", done, 4, -1, what});
  };
  ORBITFUSE_ASSIGN(const std::vector<const FrameRecord*> stations, stations_of(frames));
  const std::vector<const FrameRecord*> tracking =
      visible.renderer ? tracking_of(frames, *stations.front()) : std::vector<const FrameRecord*>{};
  const std::size_t wanted = stations.size() + tracking.size();
  tell(0, "lines of the visible scene");
  ORBITFUSE_ASSIGN(const Evidence evidence,
                   gather(session, visible.reconstruction, stations, progress));
  tell(1, "search of the orbit");
  const bool renders = static_cast<bool>(visible.renderer);
  ORBITFUSE_ASSIGN(const std::vector<OrbitHypothesis> hypotheses,
                   search(evidence, renders, progress));
  const Result<PlacedViews> placed =
      renders
          ? place_by_renders(session, visible, evidence, hypotheses, tracking, progress)
          : place_by_lines(evidence.work, hypotheses, evidence.canonical_from_visible, progress);
  LadderStep step{"cross-modal, orbit prior", false, "", 0, static_cast<int>(wanted), 0};
  step.why = fmt::format("{} lines", evidence.work.lines.size());
  const auto finish = [&] {
    step.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    steps.push_back(step);
  };
  if (!placed) {
    step.why += "; " + placed.error().found;
    finish();
    return tl::unexpected(placed.error());
  }
  step.attempt = placed->method;
  step.why += placed->why;

  ThermalPoses result;
  result.shares_visible_frame = true;
  result.frame_count = static_cast<int>(wanted);
  result.reconstruction.modality = Modality::thermal;
  take_verdicts(*placed, result);
  step.posed = static_cast<int>(result.reconstruction.views.size());
  const Status good = believed(*placed, result, step, options);
  step.held = good.has_value();
  if (!good) step.why += "; " + good.error().found;
  finish();
  if (!good) return tl::unexpected(good.error());
  if (frames.size() > wanted)
    result.skips.push_back(
        {"poses of further tracking frames",
         fmt::format("{} of {} frames are posed", wanted, frames.size()),
         visible.renderer ? "they lie between the others" : "they need a trained visible field"});
  result.skips.push_back({"thermal COLMAP", "thermal views were placed in the visible scene",
                          "no feature matching; one frame for both modalities"});
  return result;
}

}  // namespace orbitfuse
