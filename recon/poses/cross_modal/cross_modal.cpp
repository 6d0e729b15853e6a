// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/cross_modal.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/alignment/edge_field.hpp"
#include "recon/poses/cross_modal/edge_lines.hpp"
#include "recon/poses/cross_modal/mirrored_views.hpp"
#include "recon/poses/cross_modal/orbit_frames.hpp"
#include "recon/poses/cross_modal/orbit_selection.hpp"
#include "recon/poses/cross_modal/tracking_views.hpp"
#include "recon/poses/cross_modal/view_recovery.hpp"
#include "recon/poses/cross_modal/view_verdicts.hpp"
#include "recon/poses/scene_views.hpp"
#include "recon/poses/thermal_lens.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Frames recorded at video rate say no more than one every few degrees.
constexpr int max_tracking_frames = 96;
/// Below this share of sure views the answer as a whole is not one.
constexpr double min_sure_ratio = 0.5;
/// Lead of the best start over a rival, in standard errors: below the first nobody knows which is
/// right, below the second nobody is sure.
constexpr double undecided_lead = 1, sure_lead = 2;
/// Below, the search leaves more to renders.
constexpr std::size_t few_views = 16;

/// Thermal stations and what they are looked for in.
struct OrbitWork {
  LensGuess lens;
  LineModel lines;
  std::vector<const FrameRecord*> frames;
  std::vector<cv::Mat> images;
};

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
Status pose_tracking(const Session& session, const OrbitWork& work, const Camera& lens,
                     const std::vector<const FrameRecord*>& tracking, const SceneRenderer& renderer,
                     OrbitViews& orbit, RenderAlignment& rendered, const Progress& progress) {
  std::vector<PassedStation> passed;
  for (std::size_t i = 0; i < work.frames.size(); ++i) {
    const ViewVerdict& verdict = rendered.views[i].verdict;
    if (verdict.confidence == Confidence::dropped || verdict.on_probation) continue;
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
    ORBITFUSE_ASSIGN(cv::Mat image, straight_luminance(session, *frame, lens));
    orbit.images.push_back(std::move(image));
    RenderAlignedView view;
    view.view = rendered.views.front().view;
    view.view.name = frame->file;
    rendered.views.push_back(view);
  }
  return add_views(renderer, orbit, first, rendered, progress);
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
  const TraceSpan span("edge lines of the visible scene");
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
  const Camera lens = evidence.work.lens.camera.without_distortion();
  for (const FrameRecord* frame : stations) {
    ORBITFUSE_ASSIGN(cv::Mat values,
                     straight_luminance(session, *frame, evidence.work.lens.camera));
    evidence.search.push_back({orientation_field(values, 2.0 * frame->width / 640.0), lens});
    evidence.work.images.push_back(std::move(values));
  }
  const Camera& seen = canonical.views.front().camera;
  evidence.similar_distance = lens.fx / lens.width * seen.width / seen.fx;
  return evidence;
}

Result<std::vector<OrbitHypothesis>> search(const Evidence& evidence, const Progress& progress) {
  const TraceSpan span("orbit search");
  OrbitSearchOptions options;
  options.nearest = 0.4 * evidence.similar_distance;
  options.farthest = 1.8 * evidence.similar_distance;
  // Renders decide; a rival that isn't opened can't be told from the best. Few views have few
  // votes: of half an orbit of `statue` the true start came sixth.
  const bool few = evidence.search.size() < few_views;
  options.hypotheses = few ? 10 : 4;
  ORBITFUSE_ASSIGN(const OrbitTable table,
                   tabulate_orbit(evidence.work.lines, evidence.search, options, progress));
  std::vector<OrbitHypothesis> found;
  for (const std::vector<Station>& layout : layouts_of(evidence.work.frames))
    for (OrbitHypothesis& hypothesis : search_orbit(table, layout, options))
      found.push_back(std::move(hypothesis));
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& x, const auto& y) { return x.score > y.score; });
  const std::size_t most = few ? 12 : 6;
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

std::string loops_in_doubt(const std::vector<int>& loops) {
  std::string text;
  for (const int loop : loops)
    text += fmt::format("{}loop {} as a whole is in doubt: look at its rendered pairs",
                        text.empty() ? "" : "; ", loop);
  return text;
}

/// The object looks much alike from another start: no view is sure of its place.
void doubt_all(double lead, RenderAlignment& rendered) {
  for (RenderAlignedView& view : rendered.views)
    if (view.verdict.sure())
      view.verdict = {Confidence::doubtful, DoubtReason::undecided,
                      fmt::format("another start of the orbit explains the views almost as well "
                                  "({:.1f} standard errors apart)",
                                  lead)};
}

/// Refused as what they are: poses of mirrored views pass every other check.
Status check_mirrored(const SceneRenderer& renderer, const ChosenOrbit& chosen,
                      const Progress& progress, PlacedViews& placed) {
  ORBITFUSE_ASSIGN(const std::optional<MirroredSupport> mirrored,
                   support_if_mirrored(renderer, chosen, progress));
  if (!mirrored) return {};
  placed.gates["mirrored_lead_standard_errors"] = mirrored->lead_standard_errors;
  if (!mirrored->told()) return {};
  return fail(ErrorKind::input, "thermal images",
              fmt::format("mirrored left to right against the photos: so turned round they fit the "
                          "visible scene {:.2f} times as well ({:.1f} standard errors)",
                          mirrored->ratio, mirrored->lead_standard_errors),
              "mirror the files back (or the photos, if those are), turn off the camera's setting, "
              "and import again; poses.check_mirrored = false (--set) takes them as they are");
}

/// Places the views against renders: the hypothesis and the starts, then each view to the end, then
/// the frames recorded between the stations, then the verdicts.
Result<PlacedViews> place_by_renders(const Session& session, const VisibleScene& visible,
                                     const Evidence& evidence,
                                     const std::vector<OrbitHypothesis>& hypotheses,
                                     const std::vector<const FrameRecord*>& tracking,
                                     const PoseOptions& options, const Progress& progress) {
  progress.report({"poses.thermal", 2, 4, {}, "views of the scene"});
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   scene_of(visible, evidence.canonical_from_visible, progress));
  OrbitViews orbit;
  orbit.images = evidence.work.images;
  orbit.canonical_from_world = evidence.canonical_from_visible;
  orbit.assumed = !all_have_stations(evidence.work.frames);
  std::vector<PosedView> blank;
  for (const FrameRecord* frame : evidence.work.frames)
    blank.push_back({frame->file, evidence.work.lens.camera.without_distortion(), {}});
  ORBITFUSE_ASSIGN(SelectedOrbit selected,
                   select_by_renders(renderer, orbit, blank, hypotheses, progress));
  PlacedViews placed;
  placed.method = "cross-modal, orbit prior and renders";
  placed.why = words(selected);
  RenderAlignment& rendered = selected.alignment;
  const double lead =
      selected.lead_standard_errors.value_or(std::numeric_limits<double>::infinity());
  if (std::isfinite(lead)) placed.gates["start_lead_standard_errors"] = lead;
  if (options.check_mirrored)
    ORBITFUSE_TRY(check_mirrored(renderer,
                                 {evidence.work.lines, evidence.search, orbit, blank,
                                  hypotheses[selected.hypothesis], selected},
                                 progress, placed));
  if (!(lead >= undecided_lead))
    return fail(ErrorKind::quality, "poses.thermal",
                fmt::format("two starts of the orbit explain the thermal views about equally well "
                            "({:.1f} standard errors apart){}",
                            lead, placed.why),
                "record more thermal stations, or give known poses: the object looks alike from "
                "both sides");
  progress.report({"poses.thermal", 3, 4, {}, "alignment with renders"});
  LensGuess lens = evidence.work.lens;
  ORBITFUSE_TRY(refine_orbit(renderer, orbit, rendered,
                             {lens.focal_relative_sigma, lens.radial_sigma}, progress));
  // k1 belongs to the focal length that it was found with.
  lens.camera.fx = rendered.views.front().view.camera.fx;
  lens.camera.fy = rendered.views.front().view.camera.fy;
  lens.camera.k1 += rendered.radial;
  if (lens.guessed)
    placed.warnings.push_back(
        fmt::format("the thermal lens is unknown: 33 degrees were assumed to begin with, and "
                    "{:.1f} found ({:.0f} px); give its focal length (import --thermal-focal-px) "
                    "if you know it better",
                    lens.camera.horizontal_fov_deg(), lens.camera.fx));
  if (!tracking.empty())
    ORBITFUSE_TRY(pose_tracking(session, evidence.work, lens.camera, tracking, renderer, orbit,
                                rendered, progress));
  ORBITFUSE_ASSIGN(const std::vector<int> doubted,
                   judge_views({renderer, orbit, progress}, blank.size(), rendered));
  if (lead < sure_lead) doubt_all(lead, rendered);
  if (!doubted.empty()) placed.warnings.push_back(loops_in_doubt(doubted));
  for (const RenderAlignedView& view : rendered.views) {
    placed.views.push_back({view.view, view.verdict, view.agreement, view.median_px});
    // The images are as their lens has distorted them.
    Camera& camera = placed.views.back().view.camera;
    const double fx = camera.fx, fy = camera.fy;
    camera = lens.camera;
    camera.fx = fx, camera.fy = fy;
  }
  placed.gates["focal_px"] = rendered.focal_px;
  placed.gates["lens_k1"] = lens.camera.k1;
  placed.gates["loops_in_doubt"] = static_cast<double>(doubted.size());
  return placed;
}

/// The answer as a whole: enough stations, and most of them sure. Frames between them come and go.
Status believed(const PlacedViews& placed, std::size_t stations, const LadderStep& step,
                const PoseOptions& options) {
  double posed = 0, sure = 0;
  for (std::size_t i = 0; i < stations; ++i) {
    posed += placed.views[i].verdict.confidence != Confidence::dropped ? 1 : 0;
    sure += placed.views[i].verdict.sure() ? 1 : 0;
  }
  const auto all = static_cast<double>(stations);
  if (posed >= options.min_posed_ratio * all && sure >= min_sure_ratio * all) return {};
  std::string found =
      fmt::format("{} of {} thermal views are placed, {:.0f} of {} stations for sure", step.posed,
                  step.total, sure, stations);
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
    progress.report({"poses.thermal", done, 4, {}, what});
  };
  if (!visible.renderer)
    return fail(ErrorKind::quality, "poses.thermal",
                "there is no renderer of the visible scene to place thermal views in",
                "train the visible field first");
  ORBITFUSE_ASSIGN(const OrbitFrames orbit, orbit_frames(frames, max_tracking_frames));
  const std::vector<const FrameRecord*>& stations = orbit.stations;
  const std::size_t wanted = stations.size() + orbit.tracking.size() + orbit.left_out.size();
  tell(0, "lines of the visible scene");
  ORBITFUSE_ASSIGN(const Evidence evidence,
                   gather(session, visible.reconstruction, stations, progress));
  tell(1, "search of the orbit");
  ORBITFUSE_ASSIGN(const std::vector<OrbitHypothesis> hypotheses, search(evidence, progress));
  const Result<PlacedViews> placed =
      place_by_renders(session, visible, evidence, hypotheses, orbit.tracking, options, progress);
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
  for (const auto& [name, why] : orbit.left_out) result.dropped.push_back({name, why});
  take_verdicts(*placed, result);
  step.posed = static_cast<int>(result.reconstruction.views.size());
  const Status good = believed(*placed, stations.size(), step, options);
  step.held = good.has_value();
  if (!good) step.why += "; " + good.error().found;
  finish();
  if (!good) return tl::unexpected(good.error());
  if (frames.size() > wanted)
    result.skips.push_back({"poses of further tracking frames",
                            fmt::format("{} of {} frames are posed", wanted, frames.size()),
                            "they lie between the others"});
  result.skips.push_back({"thermal COLMAP", "thermal views were placed in the visible scene",
                          "no feature matching; one frame for both modalities"});
  return result;
}

}  // namespace orbitfuse
