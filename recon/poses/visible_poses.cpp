// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include <fmt/format.h>

#include "recon/poses/estimate/visible_ladder.hpp"
#include "recon/poses/known/photo_check.hpp"
#include "recon/poses/known/session_poses.hpp"

namespace orbitfuse {

Result<ModalityPoses> estimate_visible_poses(const Session& session, const PoseOptions& options,
                                             const std::filesystem::path& workdir,
                                             const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(progress.check("poses.visible"));
  if (options.use_known_poses && has_known_poses(session, Modality::visible)) {
    ORBITFUSE_ASSIGN(ModalityPoses known, known_poses(session, Modality::visible));
    if (options.check_known_poses)
      ORBITFUSE_TRY(check_by_photos(session, options, workdir / "visible", progress, known));
    return known;
  }
  const auto frames = session.frames_of(Modality::visible, options.use_tracking_frames);
  if (frames.size() < 2)
    return fail(ErrorKind::input, session.folder.string(),
                fmt::format("{} visible frames, at least 2 are needed", frames.size()),
                "record or import more views");
  std::vector<LadderStep> steps;
  ORBITFUSE_ASSIGN(ModalityPoses poses, pose_visible_views(session, frames, options,
                                                           workdir / "visible", progress, steps));
  poses.ladder = std::move(steps);
  return poses;
}

}  // namespace orbitfuse
