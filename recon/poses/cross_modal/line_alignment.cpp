// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/cross_modal/line_alignment.hpp"

#include "recon/alignment/edge_field.hpp"

#include <algorithm>

#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse {
namespace {

struct Refined {
  OrbitPose pose;
  double score = -2;
};

/// Fields of one view at the scales of the pattern search.
struct Scales {
  cv::Mat coarse, fine;
};

Scales scales_of(const OrbitWork& work, std::size_t i) {
  const double unit = work.lens.camera.width / 640.0;
  const auto shrunk = [](const cv::Mat& field, int by) {
    return cell_field(field, std::max(1, field.cols / by), std::max(1, field.rows / by));
  };
  return {shrunk(orientation_field(work.images[i], 6.0 * unit), 4),
          shrunk(orientation_field(work.images[i], 3.0 * unit), 2)};
}

/// The best of several starts: each searched at the coarse scale, the best few at the fine one.
Refined refined(const OrbitWork& work, const Scales& fields, const std::vector<OrbitPose>& starts,
                const OrbitPrior& prior) {
  const double unit = work.lens.camera.width / 640.0;
  std::vector<Refined> coarse;
  for (const OrbitPose& start : starts) {
    const OrbitPose pose = pattern_search(work.lines, work.lens.camera, fields.coarse, start,
                                          {3.0, 0.06, 1.5, 16.0 * unit, 2}, prior);
    coarse.push_back(
        {pose, alignment_score(work.lines, work.lens.camera,
                               cam_from_world_of(pose, work.lens.camera), fields.coarse) -
                   prior.penalty(pose)});
  }
  std::stable_sort(coarse.begin(), coarse.end(),
                   [](const Refined& x, const Refined& y) { return x.score > y.score; });
  coarse.resize(std::min<std::size_t>(coarse.size(), 3));
  Refined best;
  for (const Refined& start : coarse) {
    const OrbitPose pose = pattern_search(work.lines, work.lens.camera, fields.fine, start.pose,
                                          {1.5, 0.03, 1.0, 8.0 * unit, 3}, prior);
    const double score = alignment_score(work.lines, work.lens.camera,
                                         cam_from_world_of(pose, work.lens.camera), fields.fine) -
                         prior.penalty(pose);
    if (score > best.score) best = {pose, score};
  }
  return best;
}

std::vector<OrbitPose> poses_of(const std::vector<Refined>& found) {
  std::vector<OrbitPose> poses;
  for (const Refined& one : found) poses.push_back(one.pose);
  return poses;
}

/// Every view on its own, then once more from where its loop says it should be.
std::vector<OrbitPose> refined_views(const OrbitWork& work, const OrbitHypothesis& hypothesis,
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

}  // namespace

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

OrbitPrior loop_prior(const OrbitWork& work, const std::vector<OrbitPose>& poses,
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
  prior.pose.azimuth_deg = nominal(view) + median(turn);
  prior.pose.elevation_deg = median(elevation);
  prior.pose.radius = median(radius);
  prior.pose.shift_y_px = median(shift);
  return prior;
}

Result<AlignedOrbit> align_orbit(const OrbitWork& work, const OrbitHypothesis& hypothesis,
                                 const Progress& progress) {
  AlignedOrbit result{hypothesis, {}, {}, {}};
  std::vector<OrbitPose>& poses = result.hypothesis.poses;
  poses = refined_views(work, hypothesis, progress);
  ORBITFUSE_TRY(progress.check("poses.thermal"));
  const double unit = work.lens.camera.width / 640.0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    result.views.push_back(
        {orientation_field(work.images[i], 1.2 * unit),
         {work.frames[i]->file, work.lens.camera, cam_from_world_of(poses[i], work.lens.camera)}});
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

}  // namespace orbitfuse
