// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/cross_modal.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "recon/alignment/edge_field.hpp"
#include "recon/alignment/luminance.hpp"
#include "recon/poses/cross_modal/edge_lines.hpp"
#include "recon/poses/cross_modal/line_alignment.hpp"
#include "recon/poses/cross_modal/orbit_rescue.hpp"
#include "recon/poses/cross_modal/tracking_views.hpp"
#include "recon/poses/world_frame.hpp"

namespace orbitfuse {
namespace {

/// Below this the best start angle is not told from the next one (standard errors): refused.
constexpr double min_decisiveness = 1.0;
/// Below this the answer is given, with the rival named.
constexpr double clear_decisiveness = 2.5;
/// Stations are nominal to several degrees; beyond this a pose contradicts its station.
constexpr double max_station_deviation_deg = 12;
/// A view whose edges meet the lines worse than this share of the median view is not supported.
constexpr double min_share_of_median = 0.55;

/// Frames recorded at video rate say no more than one every few degrees.
constexpr int max_tracking_frames = 96;

/// Share of its distance that a view may leave the orbit's search by before it contradicts it.
constexpr double max_move = 0.15;

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

/// Mean of the paired differences in their own standard error.
double standard_errors_apart(const std::vector<double>& better, const std::vector<double>& worse) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < better.size(); ++i) {
    const double d = better[i] - worse[i];
    sum += d, squares += d * d;
  }
  const auto n = static_cast<double>(better.size());
  const double variance = std::max(squares / n - (sum / n) * (sum / n), 1e-12);
  return (sum / n) / std::sqrt(variance / n);
}

/// The likelier hypotheses refined against renders; the best one's views in the visible frame.
Result<RenderAlignment> refined_by_renders(const OrbitWork& work,
                                           const std::vector<AlignedOrbit>& aligned,
                                           const Similarity3d& canonical_from_visible,
                                           const SceneRenderer& renderer, OrbitViews& orbit,
                                           LadderStep& step, const Progress& progress) {
  progress.report({"poses.thermal", 3, 4, -1, "against renders"});
  orbit = {work.images, {}, canonical_from_visible, false};
  for (const FrameRecord* frame : work.frames) orbit.stations.push_back(*frame->station);
  RenderAlignmentOptions options;
  options.focal_relative_sigma = std::max(1e-4, work.lens.focal_relative_sigma);
  RenderAlignment best;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, aligned.size()); ++i) {
    Reconstruction model;
    for (const AlignmentView& v : aligned[i].views) model.views.push_back(v.view);
    move_world(model, canonical_from_visible.inverse());
    // The first round and a look at its result tell a wrong start; the right one gets the rest.
    options.rounds = coarse_rounds();
    options.rounds.resize(2);
    ORBITFUSE_ASSIGN(RenderAlignment one,
                     align_with_renders(renderer, work.images, model.views, options, progress));
    step.why += fmt::format("; against renders from {:.0f} deg: {:.3f}",
                            aligned[i].hypothesis.offset_deg, one.mean_agreement());
    if (!best.views.empty() && one.mean_agreement() <= best.mean_agreement()) continue;
    best = std::move(one);
    orbit.clockwise = aligned[i].hypothesis.mirrored;
  }
  options.rounds = {coarse_rounds().back()};
  ORBITFUSE_ASSIGN(best, align_with_renders(renderer, work.images, best.poses(), options, progress));
  ORBITFUSE_TRY(refine_orbit(renderer, orbit, best, options.focal_relative_sigma, progress));
  return best;
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

}  // namespace

void tell_contradicted(int undecided, ModalityPoses& poses, std::string& why) {
  poses.gates["views_against_temperatures"] =
      undecided + static_cast<double>(poses.contested.size());
  if (undecided > 0)
    why += fmt::format("; {} views don't fit the others' temperatures: look at the rendered pairs",
                       undecided);
  if (poses.contested.empty()) return;
  std::string names;
  for (const ContestedView& view : poses.contested)
    names += (names.empty() ? "" : ", ") + view.name;
  why += fmt::format("; kept by the visible scene alone, against the others' temperatures: {}",
                     names);
}

Result<ThermalPoses> localise_in_visible(const Session& session, const VisibleScene& visible,
                                         const std::vector<const FrameRecord*>& frames,
                                         const PoseOptions& options, const Progress& progress,
                                         std::vector<LadderStep>& steps) {
  const auto start = std::chrono::steady_clock::now();
  const auto tell = [&](double done, const std::string& what) {
    progress.report({"poses.thermal", done, 4, -1, what});
  };
  std::vector<const FrameRecord*> stations;
  for (const FrameRecord* frame : frames)
    if (frame->station && !frame->tracking) stations.push_back(frame);
  if (stations.size() < 4)
    return fail(ErrorKind::quality, "poses.thermal",
                fmt::format("{} thermal frames carry stations, 4 are needed to place an orbit",
                            stations.size()),
                "import again and say how the views were taken, e.g. --station-spacing-deg 30 --loops 2");

  const std::vector<const FrameRecord*> tracking =
      visible.renderer ? tracking_of(frames, *stations.front()) : std::vector<const FrameRecord*>{};
  const std::size_t wanted = stations.size() + tracking.size();

  tell(0, "lines of the visible scene");
  const Similarity3d canonical_from_visible =
      canonical_from_world(visible.reconstruction.views, {});
  Reconstruction canonical = visible.reconstruction;
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

  OrbitWork work{lens_of(session, *stations.front()), LineModel(lines, centers), stations, {}};
  std::vector<SearchView> search;
  for (const FrameRecord* frame : stations) {
    ORBITFUSE_ASSIGN(cv::Mat values, read_luminance(session, *frame));
    search.push_back(
        {orientation_field(values, 2.0 * frame->width / 640.0), work.lens.camera, frame->station});
    work.images.push_back(std::move(values));
  }

  tell(1, "search of the orbit");
  OrbitSearchOptions orbit;
  // At this distance the thermal image shows as much of the scene as the visible one did.
  const Camera& seen = canonical.views.front().camera;
  const double similar = work.lens.camera.fx / work.lens.camera.width * seen.width / seen.fx;
  orbit.nearest = 0.4 * similar;
  orbit.farthest = 1.8 * similar;
  ORBITFUSE_ASSIGN(const std::vector<OrbitHypothesis> hypotheses,
                   search_orbit(work.lines, search, orbit, progress));

  std::vector<AlignedOrbit> aligned;
  for (const OrbitHypothesis& hypothesis : hypotheses) {
    tell(2, fmt::format("alignment from {:.0f} deg", hypothesis.offset_deg));
    ORBITFUSE_ASSIGN(AlignedOrbit one, align_orbit(work, hypothesis, progress));
    aligned.push_back(std::move(one));
  }
  std::stable_sort(aligned.begin(), aligned.end(),
                   [](const AlignedOrbit& x, const AlignedOrbit& y) {
                     return x.mean_support() > y.mean_support();
                   });
  const AlignedOrbit& best = aligned.front();
  const double decisiveness =
      aligned.size() > 1 ? standard_errors_apart(best.support, aligned[1].support) : 1e3;
  LadderStep step{"cross-modal, orbit prior", false, "", 0, static_cast<int>(wanted), 0};
  step.why = fmt::format("{} lines", lines.size());
  for (const AlignedOrbit& one : aligned)
    step.why += fmt::format("; start at {:.0f} deg{}: agreement {:.3f}", one.hypothesis.offset_deg,
                            one.hypothesis.mirrored ? " clockwise" : "", one.mean_support());
  step.why += fmt::format("; {:.1f} standard errors apart", decisiveness);
  // Renders of the scene tell the starts apart where its lines cannot.
  if (!visible.renderer && decisiveness < min_decisiveness) {
    step.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    steps.push_back(step);
    return fail(ErrorKind::quality, "poses.thermal", step.why + ": undecided",
                "record more thermal stations, or thermal views whose edges show form");
  }
  if (decisiveness < clear_decisiveness)
    step.why += ": doubtful, check the start angle in the rendered pairs";
  std::vector<PosedView> views;
  std::vector<double> support = best.support;
  std::vector<std::string> doubts(support.size()), objections(support.size());
  AlignmentReport report = best.report;
  int undecided = 0;
  if (visible.renderer) {
    tell(3, "alignment with renders");
    OrbitViews views_of_orbit;
    ORBITFUSE_ASSIGN(RenderAlignment rendered,
                     refined_by_renders(work, aligned, canonical_from_visible, visible.renderer,
                                        views_of_orbit, step, progress));
    if (!tracking.empty())
      ORBITFUSE_TRY(pose_tracking(session, work, tracking, visible.renderer, views_of_orbit,
                                  rendered, progress));
    report.focal_px = rendered.focal_px;
    undecided = rendered.undecided;
    support.resize(rendered.views.size());
    doubts.resize(rendered.views.size());
    objections.resize(rendered.views.size());
    report.residual_px.resize(rendered.views.size());
    for (std::size_t i = 0; i < rendered.views.size(); ++i) {
      views.push_back(rendered.views[i].view);
      support[i] = rendered.views[i].agreement;
      doubts[i] = rendered.views[i].doubt;
      objections[i] = rendered.views[i].objection;
      report.residual_px[i] = rendered.views[i].median_px;
    }
    step.rung = "cross-modal, orbit prior and renders";
  } else {
    Reconstruction model;
    for (const AlignmentView& v : best.views) model.views.push_back(v.view);
    move_world(model, canonical_from_visible.inverse());
    views = std::move(model.views);
  }

  ThermalPoses result;
  result.shares_visible_frame = true;
  result.frame_count = static_cast<int>(wanted);
  result.reconstruction.modality = Modality::thermal;
  std::vector<double> sorted = support;
  std::sort(sorted.begin(), sorted.end());
  const double typical = sorted[sorted.size() / 2];
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!(support[i] >= min_share_of_median * typical)) {
      result.dropped.push_back(
          {views[i].name, fmt::format("its edges agree with the visible scene at {:.3f}, the "
                                      "median view at {:.3f}",
                                      support[i], typical)});
      continue;
    }
    if (!doubts[i].empty()) {
      result.dropped.push_back({views[i].name, doubts[i]});
      continue;
    }
    // Lines alone can pull a view astray; against renders its agreement has been judged already.
    if (!visible.renderer) {
      const Rigid3d& lined_up = best.views[i].view.cam_from_world;
      const Rigid3d expected = cam_from_world_of(best.hypothesis.poses[i], work.lens.camera);
      const Eigen::Vector3d place = camera_center(expected);
      const double moved = (camera_center(lined_up) - place).norm() / place.norm();
      if (!(moved < max_move)) {
        result.dropped.push_back(
            {views[i].name, fmt::format("its edges pull it {:.0f} % of its distance away from "
                                        "where its loop says it is",
                                        100 * moved)});
        continue;
      }
      const OrbitPrior prior = loop_prior(work, best.hypothesis.poses, best.hypothesis, i);
      const OrbitAngles angles = orbit_angles(camera_center(lined_up));
      const double away = std::remainder(angles.azimuth_deg - prior.pose.azimuth_deg, 360);
      if (!(std::abs(away) < max_station_deviation_deg)) {
        result.dropped.push_back(
            {views[i].name, fmt::format("its edges fit best {:.0f} deg away from its station, "
                                        "judged by its orbit",
                                        std::abs(away))});
        continue;
      }
    }
    if (!objections[i].empty()) result.contested.push_back({views[i].name, objections[i]});
    result.reconstruction.views.push_back(views[i]);
  }
  result.gates["posed_ratio"] = result.posed_ratio();
  result.gates["edge_agreement"] = typical;
  tell_contradicted(undecided, result, step.why);
  result.gates["orbit_decisiveness"] = decisiveness;
  result.gates["focal_px"] = report.focal_px;
  result.gates["focal_sigma_percent"] = 100 * report.focal_relative_sigma;
  sorted = report.residual_px;
  std::sort(sorted.begin(), sorted.end());
  result.gates["edge_residual_px"] = sorted[sorted.size() / 2];
  step.posed = static_cast<int>(result.reconstruction.views.size());
  step.held = result.posed_ratio() >= options.min_posed_ratio;
  step.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  steps.push_back(step);
  if (!step.held)
    return fail(ErrorKind::quality, "poses.thermal",
                fmt::format("{} of {} thermal views aligned", step.posed, step.total),
                "see the dropped views");
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
