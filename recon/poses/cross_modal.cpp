// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>

#include "core/parallel.hpp"
#include "recon/poses/edge_alignment.hpp"
#include "recon/poses/edge_lines.hpp"
#include "recon/poses/orbit_search.hpp"
#include "recon/poses/proxy_images.hpp"
#include "recon/poses/orbit_rescue.hpp"
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

/// Share of its distance that a view may leave the orbit's search by before it contradicts it.
constexpr double max_move = 0.15;

struct LensGuess {
  Camera camera;
  double focal_relative_sigma = 0.03;
  bool guessed = false;
};

LensGuess lens_of(const Session& session, const FrameRecord& frame) {
  LensGuess guess;
  const DeviceInfo* device = session.device(frame.device);
  if (device != nullptr && device->lens.calibrated) {
    guess.camera = device->lens.calibrated->scaled_to(frame.width, frame.height);
    guess.focal_relative_sigma = 0;
    return guess;
  }
  double focal = 0;
  if (device != nullptr && device->lens.focal_px) {
    focal = *device->lens.focal_px;
    guess.focal_relative_sigma = device->lens.focal_relative_sigma;
  } else {
    focal = 1.7 * frame.width;  // 33 deg, between the usual thermal lenses
    guess.focal_relative_sigma = 0.3;
    guess.guessed = true;
  }
  guess.camera.width = frame.width, guess.camera.height = frame.height;
  guess.camera.fx = guess.camera.fy = focal;
  guess.camera.cx = frame.width / 2.0, guess.camera.cy = frame.height / 2.0;
  return guess;
}

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

struct Work {
  LensGuess lens;
  LineModel lines;
  std::vector<const FrameRecord*> frames;
  std::vector<cv::Mat> images;
};

struct Refined {
  OrbitPose pose;
  double score = -2;
};

/// Fields of one view at the scales of the pattern search.
struct Scales {
  cv::Mat coarse, fine;
};

Scales scales_of(const Work& work, std::size_t i) {
  const double unit = work.lens.camera.width / 640.0;
  const auto shrunk = [](const cv::Mat& field, int by) {
    return cell_field(field, std::max(1, field.cols / by), std::max(1, field.rows / by));
  };
  return {shrunk(orientation_field(work.images[i], 6.0 * unit), 4),
          shrunk(orientation_field(work.images[i], 3.0 * unit), 2)};
}

/// The best of several starts: each searched at the coarse scale, the best few at the fine one.
Refined refined(const Work& work, const Scales& fields, const std::vector<OrbitPose>& starts,
                const OrbitPrior& prior) {
  const double unit = work.lens.camera.width / 640.0;
  std::vector<Refined> coarse;
  for (const OrbitPose& start : starts) {
    const OrbitPose pose = pattern_search(work.lines, work.lens.camera, fields.coarse, start,
                                          {3.0, 0.06, 1.5, 16.0 * unit, 2}, prior);
    coarse.push_back({pose, alignment_score(work.lines, work.lens.camera,
                                            cam_from_world_of(pose, work.lens.camera),
                                            fields.coarse) -
                                prior.penalty(pose)});
  }
  std::stable_sort(coarse.begin(), coarse.end(),
                   [](const Refined& x, const Refined& y) { return x.score > y.score; });
  coarse.resize(std::min<std::size_t>(coarse.size(), 3));
  Refined best;
  for (const Refined& start : coarse) {
    const OrbitPose pose = pattern_search(work.lines, work.lens.camera, fields.fine, start.pose,
                                          {1.5, 0.03, 1.0, 8.0 * unit, 3}, prior);
    const double score = alignment_score(
        work.lines, work.lens.camera, cam_from_world_of(pose, work.lens.camera), fields.fine) -
        prior.penalty(pose);
    if (score > best.score) best = {pose, score};
  }
  return best;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Where a view should be if it kept to its loop: the operator's height and distance change little
/// within one, and the azimuths follow the stations up to one offset.
OrbitPrior loop_prior(const Work& work, const std::vector<OrbitPose>& poses,
                      const OrbitHypothesis& hypothesis, std::size_t view) {
  const double sign = hypothesis.mirrored ? -1 : 1;
  const auto nominal = [&](std::size_t i) {
    return hypothesis.offset_deg + sign * work.frames[i]->station->azimuth_deg;
  };
  std::vector<double> turn, elevation, radius, shift;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    turn.push_back(std::remainder(poses[i].azimuth_deg - nominal(i), 360));
    if (work.frames[i]->station->loop != work.frames[view]->station->loop) continue;
    elevation.push_back(poses[i].elevation_deg);
    radius.push_back(poses[i].radius);
    shift.push_back(poses[i].shift_y_px);
  }
  OrbitPrior prior;
  prior.weight = 0.005;
  prior.pose.azimuth_deg = nominal(view) + median_of(turn);
  prior.pose.elevation_deg = median_of(elevation);
  prior.pose.radius = median_of(radius);
  prior.pose.shift_y_px = median_of(shift);
  return prior;
}

std::vector<OrbitPose> poses_of(const std::vector<Refined>& found) {
  std::vector<OrbitPose> poses;
  for (const Refined& one : found) poses.push_back(one.pose);
  return poses;
}

/// Every view on its own, then once more from where its loop says it should be.
std::vector<OrbitPose> refined_views(const Work& work, const OrbitHypothesis& hypothesis,
                                     const Progress& progress) {
  std::vector<Refined> found(work.images.size());
  std::vector<Scales> fields(work.images.size());
  const auto each = [&](const auto& body) {
    parallel_for(static_cast<int>(found.size()), [&](int i) {
      if (!progress.cancelled()) body(static_cast<std::size_t>(i));
    });
  };
  each([&](std::size_t i) {
    fields[i] = scales_of(work, i);
    found[i] = refined(work, fields[i], hypothesis.starts[i], {});
  });
  for (int round = 0; round < 2; ++round) {
    const std::vector<OrbitPose> before = poses_of(found);
    each([&](std::size_t i) {
      const OrbitPrior prior = loop_prior(work, before, hypothesis, i);
      std::vector<OrbitPose> starts = {before[i]};
      for (const double azimuth : {-5.0, 0.0, 5.0}) {
        starts.push_back(prior.pose);
        starts.back().azimuth_deg += azimuth;
      }
      found[i] = refined(work, fields[i], starts, prior);
    });
  }
  return poses_of(found);
}

/// One hypothesis taken to the end.
struct Aligned {
  OrbitHypothesis hypothesis;
  std::vector<AlignmentView> views;
  AlignmentReport report;
  std::vector<double> support;  ///< agreement of each view's edges with the scene's lines

  double mean_support() const {
    double sum = 0;
    for (const double s : support) sum += s;
    return sum / static_cast<double>(std::max<std::size_t>(support.size(), 1));
  }
};

Result<Aligned> align(const Work& work, const OrbitHypothesis& hypothesis,
                      const Progress& progress) {
  Aligned result{hypothesis, {}, {}, {}};
  std::vector<OrbitPose>& poses = result.hypothesis.poses;
  poses = refined_views(work, hypothesis, progress);
  ORBITFUSE_TRY(progress.check("poses.thermal"));
  const double unit = work.lens.camera.width / 640.0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    result.views.push_back({orientation_field(work.images[i], 1.2 * unit),
                            {work.frames[i]->file, work.lens.camera,
                             cam_from_world_of(poses[i], work.lens.camera)}});
  AlignmentOptions alignment;
  alignment.focal_px = work.lens.camera.fx;
  alignment.focal_relative_sigma = work.lens.focal_relative_sigma;
  alignment.first_reach_px *= unit;
  alignment.last_reach_px *= unit;
  ORBITFUSE_ASSIGN(result.report, align_edges(work.lines, result.views, alignment, progress));
  for (std::size_t i = 0; i < poses.size(); ++i)
    result.support.push_back(alignment_score(work.lines, result.views[i].view.camera,
                                             result.views[i].view.cam_from_world,
                                             orientation_field(work.images[i], 2.0 * unit)));
  return result;
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
Result<RenderAlignment> refined_by_renders(const Work& work, const std::vector<Aligned>& aligned,
                                           const Similarity3d& canonical_from_visible,
                                           const SceneRenderer& renderer, LadderStep& step,
                                           const Progress& progress) {
  progress.report({"poses.thermal", 3, 4, -1, "against renders"});
  OrbitViews orbit{work.images, {}, canonical_from_visible, false};
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
    ORBITFUSE_ASSIGN(RenderAlignment one, align_with_renders(renderer, work.images, model.views, options, progress));
    step.why += fmt::format("; against renders from {:.0f} deg: {:.3f}", aligned[i].hypothesis.offset_deg,
                            one.mean_agreement());
    if (!best.views.empty() && one.mean_agreement() <= best.mean_agreement()) continue;
    best = std::move(one);
    orbit.clockwise = aligned[i].hypothesis.mirrored;
  }
  {
    std::vector<PosedView> views;
    for (const RenderAlignedView& v : best.views) views.push_back(v.view);
    options.rounds = {coarse_rounds().back()};
    ORBITFUSE_ASSIGN(best, align_with_renders(renderer, work.images, views, options, progress));
  }
  ORBITFUSE_TRY(refine_orbit(renderer, orbit, best, options.focal_relative_sigma, progress));
  return best;
}

}  // namespace

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
                "declare the stations on import (spacing and number of loops)");

  tell(0, "lines of the visible scene");
  const Similarity3d canonical_from_visible =
      canonical_from_world(visible.reconstruction.views, {});
  Reconstruction canonical = visible.reconstruction;
  move_world(canonical, canonical_from_visible);
  ORBITFUSE_ASSIGN(const std::vector<EdgeLine> all_lines,
                   visible_edge_lines(session, canonical, {}, progress));
  const std::vector<EdgeLine> lines = confirmed(all_lines);
  if (lines.size() < 30)
    return fail(ErrorKind::quality, "poses.thermal",
                fmt::format("{} edges of the visible scene are confirmed by three views",
                            lines.size()),
                "more visible views, or a scene with edges that both cameras see");
  std::vector<Eigen::Vector3d> centers;
  for (const PosedView& view : canonical.views) centers.push_back(camera_center(view.cam_from_world));

  Work work{lens_of(session, *stations.front()), LineModel(lines, centers), stations, {}};
  std::vector<SearchView> search;
  for (const FrameRecord* frame : stations) {
    ORBITFUSE_ASSIGN(cv::Mat values, read_luminance(session, *frame));
    search.push_back({orientation_field(values, 2.0 * frame->width / 640.0), work.lens.camera,
                      frame->station});
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

  std::vector<Aligned> aligned;
  for (const OrbitHypothesis& hypothesis : hypotheses) {
    tell(2, fmt::format("alignment from {:.0f} deg", hypothesis.offset_deg));
    ORBITFUSE_ASSIGN(Aligned one, align(work, hypothesis, progress));
    aligned.push_back(std::move(one));
  }
  std::stable_sort(aligned.begin(), aligned.end(), [](const Aligned& x, const Aligned& y) {
    return x.mean_support() > y.mean_support();
  });
  const Aligned& best = aligned.front();
  const double decisiveness =
      aligned.size() > 1 ? standard_errors_apart(best.support, aligned[1].support) : 1e3;
  LadderStep step{"cross-modal, orbit prior", false, "", 0, static_cast<int>(frames.size()), 0};
  step.why = fmt::format("{} lines", lines.size());
  for (const Aligned& one : aligned)
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
  AlignmentReport report = best.report;
  if (visible.renderer) {
    tell(3, "alignment with renders");
    ORBITFUSE_ASSIGN(const RenderAlignment rendered,
                     refined_by_renders(work, aligned, canonical_from_visible, visible.renderer, step, progress));
    report.focal_px = rendered.focal_px;
    for (std::size_t i = 0; i < rendered.views.size(); ++i) {
      views.push_back(rendered.views[i].view);
      support[i] = rendered.views[i].agreement;
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
  result.frame_count = static_cast<int>(frames.size());
  result.reconstruction.modality = Modality::thermal;
  std::vector<double> sorted = support;
  std::sort(sorted.begin(), sorted.end());
  const double typical = sorted[sorted.size() / 2];
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!(support[i] >= min_share_of_median * typical)) {
      result.dropped.push_back(
          {views[i].name, fmt::format("its edges agree with the visible scene at {:.3f}, the "
                                           "median view at {:.3f}", support[i], typical)});
      continue;
    }
    // Lines alone can pull a view astray; against renders its agreement has been judged already.
    if (!visible.renderer) {
      const Rigid3d& lined_up = best.views[i].view.cam_from_world;
      const Rigid3d expected = cam_from_world_of(best.hypothesis.poses[i], work.lens.camera);
      const Eigen::Vector3d place = camera_center(expected);
      const double moved =
          (camera_center(lined_up) - place).norm() / place.norm();
      if (!(moved < max_move)) {
        result.dropped.push_back(
            {views[i].name, fmt::format("its edges pull it {:.0f} % of its distance away from "
                                             "where its loop says it is", 100 * moved)});
        continue;
      }
      const OrbitPrior prior = loop_prior(work, best.hypothesis.poses, best.hypothesis, i);
      const OrbitAngles angles = orbit_angles(camera_center(lined_up));
      const double away = std::remainder(angles.azimuth_deg - prior.pose.azimuth_deg, 360);
      if (!(std::abs(away) < max_station_deviation_deg)) {
        result.dropped.push_back({views[i].name,
                                  fmt::format("its edges fit best {:.0f} deg away from its station, "
                                              "judged by its orbit", std::abs(away))});
        continue;
      }
    }
    result.reconstruction.views.push_back(views[i]);
  }
  result.gates["posed_ratio"] = result.posed_ratio();
  result.gates["edge_agreement"] = typical;
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
  result.skips.push_back({"thermal COLMAP", "thermal views were placed in the visible scene",
                          "no feature matching; one frame for both modalities"});
  return result;
}

}  // namespace orbitfuse
