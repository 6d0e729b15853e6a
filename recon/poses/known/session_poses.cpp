// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/known/session_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "core/numeric/median.hpp"
#include "recon/poses/frame_camera.hpp"

namespace orbitfuse {
namespace {

std::optional<Camera> known_camera(const Session& session, const FrameRecord& frame) {
  if (frame.camera) return frame.camera;
  return calibrated_camera(session, frame.device, frame.width, frame.height);
}

bool at_one_place(const Reconstruction& model) {
  // Apart by no more than the rounding of what is stored, in a world however far from its origin.
  const Rigid3d& first = model.views.front().cam_from_world;
  return std::all_of(model.views.begin(), model.views.end(), [&](const PosedView& view) {
    const Rigid3d& cam = view.cam_from_world;
    const double rounding =
        1e-12 * std::max(cam.translation.norm(), first.translation.norm()) + 1e-12;
    return (camera_center(cam) - camera_center(first)).norm() <= rounding;
  });
}

/// Cameras that stand where no orbit's can, so much farther from the others than these from each
/// other that the scene's size would be theirs: a slip in a file of poses. They are dropped.
void drop_far_cameras(ModalityPoses& poses) {
  constexpr double far_ratio = 1000;
  std::vector<PosedView>& views = poses.reconstruction.views;
  constexpr std::size_t least_views = 4;  // fewer have no majority to measure by
  if (views.size() < least_views) return;
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const PosedView& view : views) along.push_back(camera_center(view.cam_from_world)(axis));
    middle(axis) = median(along);
  }
  std::vector<double> distances;
  for (const PosedView& view : views)
    distances.push_back((camera_center(view.cam_from_world) - middle).norm());
  // Not the median: half of the cameras may be a tripod's, and the others the orbit.
  std::vector<double> ordered = distances;
  const double typical = quantile(ordered, 0.75);
  if (!(typical > 1e-12 * middle.norm())) return;
  std::vector<PosedView> near;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (distances[i] <= far_ratio * typical) {
      near.push_back(std::move(views[i]));
      continue;
    }
    poses.dropped.push_back(
        {views[i].name, fmt::format("its known pose is {:.2g} times as far from the middle of the "
                                    "others as they are: correct it",
                                    distances[i] / typical)});
  }
  views = std::move(near);
}

}  // namespace

bool has_known_poses(const Session& session, Modality modality) {
  int known = 0;
  for (const FrameRecord* frame : session.frames_of(modality))
    known += frame->cam_from_world && known_camera(session, *frame) ? 1 : 0;
  return known >= 2;
}

Result<ModalityPoses> known_poses(const Session& session, Modality modality) {
  ModalityPoses poses;
  poses.reconstruction.modality = modality;
  for (const FrameRecord* frame : session.frames_of(modality)) {
    const std::optional<Camera> camera = known_camera(session, *frame);
    // Tracking frames only ever served to pose the stations.
    if (frame->tracking && !frame->cam_from_world) continue;
    ++poses.frame_count;
    if (!frame->cam_from_world || !camera) {
      poses.dropped.push_back({frame->file, "the session knows the others' poses, not this one's"});
      continue;
    }
    ORBITFUSE_TRY(camera->validate(frame->file));
    if (!frame->cam_from_world->is_finite())
      return fail(ErrorKind::input, frame->file, "its known pose is not finite",
                  "correct the imported poses, or set poses.use_known_poses = false (--set)");
    poses.reconstruction.views.push_back({frame->file, *camera, *frame->cam_from_world});
  }
  drop_far_cameras(poses);
  const int posed = static_cast<int>(poses.reconstruction.views.size());
  if (posed >= 2 && at_one_place(poses.reconstruction))
    return fail(ErrorKind::input, fmt::format("known {} poses", name(modality)),
                fmt::format("all {} cameras stand at one place", posed),
                "form needs views from several: correct the imported poses, or set "
                "poses.use_known_poses = false (--set)");
  poses.ladder.push_back(
      {"known poses", true, "the session carries them", posed, poses.frame_count, 0.0});
  poses.gates["posed_ratio"] = poses.posed_ratio();
  if (poses.posed_ratio() < PoseOptions{}.min_posed_ratio)
    poses.warnings.push_back(
        fmt::format("{} of {} {} frames have a known pose that is used, the others none: to "
                    "estimate all from the images, set poses.use_known_poses = false (--set)",
                    posed, poses.frame_count, name(modality)));
  poses.skips.push_back({fmt::format("{} pose estimation", name(modality)),
                         fmt::format("the session carries {} poses", posed),
                         "no structure from motion"});
  return poses;
}

std::vector<const FrameRecord*> frames_of(const Session& session,
                                          const std::vector<PosedView>& views) {
  std::map<std::string_view, const FrameRecord*> by_name;
  for (const FrameRecord& frame : session.frames) by_name[frame.file] = &frame;
  std::vector<const FrameRecord*> frames;
  for (const PosedView& view : views) frames.push_back(by_name.at(view.name));
  return frames;
}

void take_known_verdicts(const NamedViews& wrong, const NamedViews& doubtful, DoubtReason reason,
                         ModalityPoses& poses) {
  std::vector<PosedView>& views = poses.reconstruction.views;
  for (const auto& [view, why] : doubtful)
    poses.doubtful.push_back({views[view].name, reason, why});
  std::set<std::string> gone;
  for (const auto& [view, why] : wrong) {
    poses.dropped.push_back({views[view].name, why});
    gone.insert(views[view].name);
  }
  std::erase_if(views, [&](const PosedView& view) { return gone.contains(view.name); });
  poses.ladder.back().posed = static_cast<int>(views.size());
  poses.gates["posed_ratio"] = poses.posed_ratio();
}

Session without_known_poses(Session session, Modality modality, double true_focal) {
  constexpr double told_sigma = 0.05;
  for (FrameRecord& frame : session.frames) {
    if (frame.modality != modality) continue;
    for (DeviceInfo& device : session.devices) {
      if (device.id != frame.device || !frame.camera) continue;
      // A calibration of another source stays.
      if (calibrated_camera(session, device.id, frame.width, frame.height) == frame.camera)
        device.lens.calibrated.reset();
      if (device.lens.calibrated || device.lens.focal_px) continue;
      device.lens.focal_px = true_focal * frame.camera->fx;
      device.lens.focal_relative_sigma = told_sigma;
    }
    frame.camera.reset();
    frame.cam_from_world.reset();
  }
  return session;
}

}  // namespace orbitfuse
