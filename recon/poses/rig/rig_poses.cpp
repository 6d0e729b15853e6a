// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/rig/rig_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <tuple>

#include "core/geometry/scene_ball.hpp"
#include "recon/alignment/luminance.hpp"
#include "recon/poses/doubts.hpp"
#include "recon/poses/thermal_lens.hpp"

namespace orbitfuse {
namespace {

struct Gathered {
  std::vector<RigView> views;
  std::vector<const PosedView*> posed;  ///< the photo of each
};

/// As far ahead of each camera as the cameras look: known poses come without points.
Eigen::Vector3d looked_at(const Reconstruction& model) {
  std::vector<Rigid3d> cameras;
  for (const PosedView& view : model.views) cameras.push_back(view.cam_from_world);
  return {0, 0, scene_ball(cameras, {}).radius};
}

/// A frame of the camera that took most: one odd file doesn't decide for all.
const FrameRecord& usual_frame(const RigPairs& rig) {
  const auto kind = [](const FrameRecord& frame) {
    return std::tuple(frame.device, frame.width, frame.height);
  };
  std::map<std::tuple<std::string, int, int>, int> count;
  for (const auto& [photo, thermal] : rig.pairs) ++count[kind(*thermal)];
  const auto most =
      std::max_element(rig.pairs.begin(), rig.pairs.end(), [&](const auto& a, const auto& b) {
        return count[kind(*a.second)] < count[kind(*b.second)];
      });
  return *most->second;
}

Result<Gathered> gather(const Session& session, const Reconstruction& visible, const RigPairs& rig,
                        const FrameRecord& usual, ModalityPoses& poses) {
  std::map<std::string, int> view_of;
  for (std::size_t v = 0; v < visible.views.size(); ++v)
    view_of[visible.views[v].name] = static_cast<int>(v);
  std::vector<std::vector<Eigen::Vector3d>> seen(visible.views.size());
  for (const SparsePoint& point : visible.points)
    for (const Observation& o : point.track) {
      const auto v = static_cast<std::size_t>(o.view);
      seen[v].push_back(visible.views[v].cam_from_world * point.position);
    }
  if (visible.points.empty()) {
    const Eigen::Vector3d ahead = looked_at(visible);
    for (auto& points : seen) points.push_back(ahead);
  }
  Gathered result;
  for (const auto& [photo, thermal] : rig.pairs) {
    const auto found = view_of.find(photo->file);
    if (found == view_of.end()) {
      poses.dropped.push_back({thermal->file, "its photo has no pose"});
      continue;
    }
    if (thermal->device != usual.device || thermal->width != usual.width ||
        thermal->height != usual.height) {
      poses.dropped.push_back(
          {thermal->file, "it is of another camera or size than most of the rig's images"});
      continue;
    }
    const auto v = static_cast<std::size_t>(found->second);
    RigView view;
    view.name = thermal->file;
    ORBITFUSE_ASSIGN(view.visible, read_luminance(session, *photo));
    ORBITFUSE_ASSIGN(view.thermal, read_luminance(session, *thermal));
    view.visible_camera = visible.views[v].camera;
    view.points = std::move(seen[v]);
    result.views.push_back(std::move(view));
    result.posed.push_back(&visible.views[v]);
  }
  return result;
}

}  // namespace

Result<ThermalPoses> pose_by_rig(const Session& session, const Reconstruction& visible,
                                 const RigPairs& rig, const Progress& progress,
                                 std::vector<LadderStep>& steps) {
  const auto start = std::chrono::steady_clock::now();
  progress.report({"poses.thermal", 0, 2, {}, "rig of " + rig.found_by});
  LadderStep step{"rig, " + rig.found_by, false, "", 0, 0, 0};
  ThermalPoses result;
  result.shares_visible_frame = true;
  result.reconstruction.modality = Modality::thermal;
  const auto frames = session.frames_of(Modality::thermal, false);
  result.frame_count = step.total = static_cast<int>(frames.size());
  const FrameRecord& usual = usual_frame(rig);
  const LensGuess lens = lens_of(session, usual);
  ORBITFUSE_ASSIGN(const Gathered gathered, gather(session, visible, rig, usual, result));
  RigOptions options;
  options.thermal_lens = lens.camera;
  options.focal_relative_sigma = lens.focal_relative_sigma;
  options.radial_sigma = lens.radial_sigma;
  if (rig.declared) options.min_held_share = declared_held_share;
  const Result<RigEstimate> found = estimate_rig(gathered.views, options, progress);
  step.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!found) {
    step.why = found.error().found;
    if (found.error().kind == ErrorKind::quality) steps.push_back(step);
    return tl::unexpected(found.error());
  }
  for (std::size_t i = 0; i < gathered.views.size(); ++i) {
    const RigPairFit& fit = found->pairs[i];
    result.reconstruction.views.push_back(
        {gathered.views[i].name, found->thermal,
         found->thermal_from_visible * gathered.posed[i]->cam_from_world});
    if (fit.agreement <= fit.control)
      result.doubtful.push_back(
          {gathered.views[i].name, DoubtReason::weak_support,
           fmt::format("its edges agree with its photo's by {:.3f}, other pairs' by {:.3f}",
                       fit.agreement, fit.control)});
    else if (fit.lies_elsewhere())
      result.doubtful.push_back(
          {gathered.views[i].name, DoubtReason::weak_support,
           fmt::format("in {} of {} quarters of its image the edges lie elsewhere than one "
                       "transform for all pairs has them",
                       fit.quarters_elsewhere, fit.quarters)});
    else if (rig.declared && fit.quarters == 0)
      result.doubtful.push_back({gathered.views[i].name, DoubtReason::weak_support,
                                 "both cameras see too little in common for it to be judged"});
  }
  for (const FrameRecord* frame : frames)
    if (std::none_of(rig.pairs.begin(), rig.pairs.end(),
                     [&](const auto& pair) { return pair.second == frame; }))
      result.dropped.push_back({frame->file, "no photo was shot with it"});
  result.gates["posed_ratio"] = result.posed_ratio();
  result.gates["rig_decisiveness"] = found->decisiveness;
  step.why = found->words();
  step.held = true;
  step.posed = static_cast<int>(result.reconstruction.views.size());
  steps.push_back(step);
  return result;
}

void doubt_beside(const std::map<std::string, std::string>& doubted_photos, const RigPairs& rig,
                  ThermalPoses& poses) {
  for (const PosedView& view : poses.reconstruction.views)
    for (const auto& [photo, thermal] : rig.pairs) {
      const auto doubted = doubted_photos.find(photo->file);
      if (thermal->file == view.name && doubted != doubted_photos.end())
        add_doubt(
            {view.name, DoubtReason::uncertain_place,
             fmt::format("its photo, {}, may be misplaced: {}", photo->file, doubted->second)},
            poses.doubtful);
    }
}

}  // namespace orbitfuse
