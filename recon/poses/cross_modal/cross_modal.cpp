// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/cross_modal.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "core/numeric/median.hpp"
#include "core/system/trace.hpp"
#include "recon/poses/cross_modal/mirrored_views.hpp"
#include "recon/poses/cross_modal/orbit_choice.hpp"
#include "recon/poses/cross_modal/orbit_frames.hpp"
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
/// Support of upright views, on average: 17 to 52 on seven scenes, 1 to 11 of turned ones.
constexpr double usual_support = 12;
/// Cameras that stand lower than this look up at the object, or their images are upside down.
constexpr double below_deg = -5;
/// Lead of the best start over a rival, in standard errors: below the first nobody knows which is
/// right, below the second nobody is sure.
constexpr double undecided_lead = 1, sure_lead = 2;
/// Frames recorded between the stations, posed among them; appended to `rendered`.
Status pose_tracking(const Session& session, const OrbitEvidence& evidence, const Camera& lens,
                     const std::vector<const FrameRecord*>& tracking, const SceneRenderer& renderer,
                     OrbitViews& orbit, RenderAlignment& rendered, const Progress& progress) {
  std::vector<PassedStation> passed;
  for (std::size_t i = 0; i < evidence.frames.size(); ++i) {
    const ViewVerdict& verdict = rendered.views[i].verdict;
    if (verdict.confidence == Confidence::dropped || verdict.on_probation) continue;
    const Rigid3d cam = rebase(rendered.views[i].view.cam_from_world, orbit.canonical_from_world);
    passed.push_back({evidence.frames[i]->sequence, orbit.stations[i],
                      orbit_angles(camera_center(cam)).azimuth_deg});
  }
  std::vector<std::uint64_t> sequences;
  for (const FrameRecord* frame : tracking) sequences.push_back(frame->sequence);
  const double offset_deg = station_offset_deg(orbit, rendered);
  for (const Station& station : stations_between(passed, sequences, orbit.clockwise, offset_deg))
    orbit.stations.push_back(station);
  const std::size_t first = rendered.views.size();
  for (const FrameRecord* frame : tracking) {
    ORBITFUSE_ASSIGN(const cv::Mat image, straight_luminance(session, *frame, lens));
    orbit.images.push_back(upright(evidence.turn, image));
    RenderAlignedView view;
    view.view = rendered.views.front().view;
    view.view.name = frame->file;
    rendered.views.push_back(view);
  }
  return add_views(renderer, orbit, first, rendered, progress);
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

const char* how_held(QuarterTurn turn) {
  return turn.clockwise == 2 ? "upside down" : "on its side";
}

std::string words(QuarterTurn turn) {
  return turn.clockwise == 0 ? "" : fmt::format("; the camera was held {}", how_held(turn));
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

Result<std::optional<MirroredSupport>> mirrored_support(const SceneRenderer& renderer,
                                                        const OrbitChoice& choice,
                                                        const Progress& progress) {
  return support_if_mirrored(
      renderer,
      {choice.evidence.lines, choice.evidence.search, choice.orbit, choice.blank,
       choice.hypotheses[choice.selected.hypothesis], choice.selected},
      progress);
}

/// Refused as what they are: poses of mirrored views pass every other check.
tl::unexpected<Error> are_mirrored(const MirroredSupport& mirrored, QuarterTurn turn) {
  // Upside down and mirrored left to right is mirrored top to bottom.
  constexpr const char* ways[] = {"left to right", "about a diagonal", "top to bottom",
                                  "about a diagonal"};
  return fail(ErrorKind::input, "thermal images",
              fmt::format("mirrored {} against the photos: so turned round they fit the "
                          "visible scene {:.2f} times as well ({:.1f} standard errors)",
                          ways[turn.clockwise], mirrored.ratio, mirrored.lead_standard_errors),
              "mirror the files back (or the photos, if those are), turn off the camera's setting, "
              "and import again; poses.check_mirrored = false (--set) takes them as they are");
}

/// The images are as their camera was held and their lens has distorted them.
PlacedView as_taken(QuarterTurn turn, const Camera& lens, const RenderAlignedView& view) {
  PosedView taken = as_taken(turn, view.view);
  const double fx = taken.camera.fx, fy = taken.camera.fy;
  taken.camera = lens;
  taken.camera.fx = fx, taken.camera.fy = fy;
  return {taken, view.verdict, view.agreement, view.median_px};
}

/// How the camera was held, and what came of its lens.
void tell_camera(const LensGuess& lens, QuarterTurn turn, PlacedViews& placed) {
  if (turn.clockwise != 0) {
    placed.warnings.push_back(fmt::format(
        "the thermal camera was held {} against the visible one: its images fit the scene turned "
        "by {:.0f} deg, and are posed so",
        how_held(turn), turn.degrees()));
    placed.gates["images_turned_deg"] = turn.degrees();
  }
  const double longer_side_deg =
      std::max(lens.camera.horizontal_fov_deg(), upright({1}, lens.camera).horizontal_fov_deg());
  placed.gates["focal_px"] = lens.camera.fx;
  placed.gates["lens_k1"] = lens.camera.k1;
  if (lens.guessed)
    placed.warnings.push_back(
        fmt::format("the thermal lens is unknown: 33 degrees were assumed to begin with, and "
                    "{:.1f} found ({:.0f} px); give its focal length (import --thermal-focal-px) "
                    "if you know it better",
                    longer_side_deg, lens.camera.fx));
}

/// Aligns the views of a chosen start with renders, then the frames recorded between the stations,
/// then judges them all.
Result<PlacedViews> place_by_renders(const Session& session, const SceneRenderer& renderer,
                                     OrbitChoice choice,
                                     const std::vector<const FrameRecord*>& tracking,
                                     const Progress& progress) {
  const OrbitEvidence& evidence = choice.evidence;
  OrbitViews& orbit = choice.orbit;
  PlacedViews placed;
  placed.method = "cross-modal, orbit prior and renders";
  placed.why = words(choice.selected) + words(evidence.turn);
  const double lead = choice.lead();
  if (std::isfinite(lead)) placed.gates["start_lead_standard_errors"] = lead;
  if (!(lead >= undecided_lead))
    return fail(ErrorKind::quality, "poses.thermal",
                fmt::format("two starts of the orbit explain the thermal views about equally well "
                            "({:.1f} standard errors apart){}",
                            lead, placed.why),
                "record more thermal stations, or give known poses: the object looks alike from "
                "both sides");
  progress.report({"poses.thermal", 3, 4, {}, "alignment with renders"});
  RenderAlignment& rendered = choice.selected.alignment;
  LensGuess lens = evidence.lens;
  ORBITFUSE_TRY(refine_orbit(renderer, orbit, rendered,
                             {lens.focal_relative_sigma, lens.radial_sigma}, progress));
  // k1 belongs to the focal length that it was found with.
  const Camera refined = as_taken(evidence.turn, rendered.views.front().view).camera;
  lens.camera.fx = refined.fx;
  lens.camera.fy = refined.fy;
  lens.camera.k1 += rendered.radial;
  if (!tracking.empty())
    ORBITFUSE_TRY(pose_tracking(session, evidence, lens.camera, tracking, renderer, orbit, rendered,
                                progress));
  ORBITFUSE_ASSIGN(const std::vector<int> doubted,
                   judge_views({renderer, orbit, progress}, choice.blank.size(), rendered));
  if (lead < sure_lead) doubt_all(lead, rendered);
  tell_camera(lens, evidence.turn, placed);
  if (!doubted.empty()) placed.warnings.push_back(loops_in_doubt(doubted));
  for (const RenderAlignedView& view : rendered.views)
    placed.views.push_back(as_taken(evidence.turn, lens.camera, view));
  placed.gates["loops_in_doubt"] = static_cast<double>(doubted.size());
  return placed;
}

/// Views that are kept, of the first `count`.
int count_kept(const PlacedViews& placed, std::size_t count) {
  return static_cast<int>(std::count_if(
      placed.views.begin(), placed.views.begin() + static_cast<std::ptrdiff_t>(count),
      [](const PlacedView& view) { return view.verdict.confidence != Confidence::dropped; }));
}

/// The answer as a whole: enough stations, and most of them sure. Frames between them come and go.
Status believed(const PlacedViews& placed, std::size_t stations, std::size_t wanted,
                const PoseOptions& options) {
  const double posed = count_kept(placed, stations);
  double sure = 0;
  for (std::size_t i = 0; i < stations; ++i) sure += placed.views[i].verdict.sure() ? 1 : 0;
  const auto all = static_cast<double>(stations);
  if (posed >= options.min_posed_ratio * all && sure >= min_sure_ratio * all) return {};
  std::string found =
      fmt::format("{} of {} thermal views are placed, {:.0f} of {} stations for sure",
                  count_kept(placed, placed.views.size()), wanted, sure, stations);
  for (const std::string& warning : placed.warnings) found += "; " + warning;
  std::map<std::string, int> reasons;
  for (const PlacedView& view : placed.views)
    if (!view.verdict.sure()) ++reasons[std::string(name(view.verdict.reason))];
  for (const auto& [reason, count] : reasons) found += fmt::format("; {} {}", count, reason);
  return fail(ErrorKind::quality, "poses.thermal", found,
              "say how the views were taken (import --station-spacing-deg, --loops, "
              "--thermal-focal-px), record more stations, or give known poses");
}

/// What a choice of the orbit's start comes to.
struct Answer {
  Result<PlacedViews> placed;
  Status good = {};             ///< of what is placed
  double mirrored_support = 0;  ///< where the images are taken for mirrored ones

  const Error* error() const { return !placed ? &placed.error() : !good ? &good.error() : nullptr; }
  bool is_poor() const { return error() != nullptr && error()->kind == ErrorKind::quality; }
};

/// How the stations of a session are placed.
struct Placing {
  const Session& session;
  const SceneRenderer& renderer;
  const OrbitFrames& orbit;
  std::size_t wanted;
  const PoseOptions& options;
  const Progress& progress;

  Answer operator()(const Result<OrbitChoice>& choice) const {
    if (!choice) return {tl::unexpected(choice.error())};
    std::optional<MirroredSupport> mirrored;
    if (options.check_mirrored) {
      auto asked = mirrored_support(renderer, *choice, progress);
      if (!asked) return {tl::unexpected(asked.error())};
      mirrored = *asked;
    }
    if (mirrored && mirrored->told())
      return {
          are_mirrored(*mirrored, choice->evidence.turn), {}, mirrored->ratio * choice->support()};
    Answer answer{place_by_renders(session, renderer, *choice, orbit.tracking, progress)};
    if (!answer.placed) return answer;
    if (mirrored)
      answer.placed->gates["mirrored_lead_standard_errors"] = mirrored->lead_standard_errors;
    answer.good = believed(*answer.placed, orbit.stations.size(), wanted, options);
    return answer;
  }
};

/// As the images are; where that comes to nothing, with the camera held otherwise.
Answer answer_of(const Placing& place, const OrbitEvidence& evidence) {
  const Result<OrbitChoice> as_is = choose_orbit(place.renderer, evidence, place.progress);
  // Views that hardly anything supports take long to refine: first see whether they are turned.
  const bool weak = as_is && as_is->support() < usual_support;
  std::optional<Answer> answer;
  if (!weak) answer = place(as_is);
  const bool mirrored = answer && answer->mirrored_support > 0;
  if (answer && !answer->is_poor() && !mirrored) return *answer;
  const Result<OrbitChoice> turned = choose_turned_orbit(place.renderer, evidence, place.progress);
  if (!turned && turned.error().kind != ErrorKind::quality) return place(turned);
  // A thing that is its own mirror image upside down looks mirrored when it is held so.
  const bool better = turned && (mirrored ? turned->support() >= answer->mirrored_support
                                 : as_is  ? turned->clearly_better_than(*as_is)
                                          : turned->support() > 0);
  if (!better) return answer ? *answer : place(as_is);
  Answer other = place(turned);
  // Worse poses of the images as they are would be wrong ones.
  return other.is_poor() && !as_is ? *answer : other;
}

/// What may be wrong with the photos where thermal views find no place among them.
std::string doubt_of_photos(const Reconstruction& visible,
                            const Similarity3d& canonical_from_visible) {
  std::vector<double> elevations_deg;
  for (const PosedView& view : visible.views)
    elevations_deg.push_back(
        orbit_angles(canonical_from_visible * camera_center(view.cam_from_world)).elevation_deg);
  if (elevations_deg.empty() || median(elevations_deg) > below_deg) return {};
  return fmt::format("; the photos look up at the object, by {:.0f} deg: are they upside down?",
                     -median(elevations_deg));
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
  ORBITFUSE_ASSIGN(const OrbitEvidence evidence,
                   gather_evidence(session, visible.reconstruction, stations, progress));
  tell(1, "views of the scene");
  ORBITFUSE_ASSIGN(const SceneRenderer renderer,
                   scene_of(visible, evidence.canonical_from_visible, progress));
  tell(2, "search of the orbit");
  const Answer answer = answer_of({session, renderer, orbit, wanted, options, progress}, evidence);
  const Result<PlacedViews>& placed = answer.placed;
  LadderStep step{"cross-modal, orbit prior", false, "", 0, static_cast<int>(wanted), 0};
  step.why = fmt::format("{} lines", evidence.lines.size());
  const auto finish = [&] {
    step.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    steps.push_back(step);
  };
  const auto fallen = [&](Error error) {
    error.found += doubt_of_photos(visible.reconstruction, evidence.canonical_from_visible);
    step.why += "; " + error.found;
    finish();
    return tl::unexpected(std::move(error));
  };
  if (!placed) return fallen(placed.error());
  step.attempt = placed->method;
  step.why += placed->why;

  ThermalPoses result;
  result.shares_visible_frame = true;
  result.frame_count = static_cast<int>(wanted);
  result.reconstruction.modality = Modality::thermal;
  for (const auto& [name, why] : orbit.left_out) result.dropped.push_back({name, why});
  take_verdicts(*placed, result);
  step.posed = static_cast<int>(result.reconstruction.views.size());
  if (!answer.good) return fallen(answer.good.error());
  step.held = true;
  finish();
  if (frames.size() > wanted)
    result.skips.push_back({"poses of further tracking frames",
                            fmt::format("{} of {} frames are posed", wanted, frames.size()),
                            "they lie between the others"});
  if (options.check_mirrored && stations.size() < least_for_mirrored)
    result.skips.push_back(
        {"check for mirrored images",
         fmt::format("{} views; {} are needed", stations.size(), least_for_mirrored),
         "images that the camera mirrored would not be noticed"});
  result.skips.push_back({"thermal COLMAP", "thermal views were placed in the visible scene",
                          "no feature matching; one frame for both modalities"});
  return result;
}

}  // namespace orbitfuse
