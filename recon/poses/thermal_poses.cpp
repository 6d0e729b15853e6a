// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate_poses.hpp"

#include <fmt/format.h>

#include "recon/poses/known_poses.hpp"
#include "recon/poses/sfm_ladder.hpp"

namespace orbitfuse {

Result<ThermalPoses> estimate_thermal_poses(const Session& session, const VisibleScene* visible,
                                            const PoseOptions& options,
                                            const std::filesystem::path& workdir,
                                            const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(progress.check("poses.thermal"));
  if (options.use_known_poses && has_known_poses(session, Modality::thermal)) {
    ORBITFUSE_ASSIGN(ModalityPoses poses, known_poses(session, Modality::thermal));
    // Known poses of a session share one world; estimated visible ones do not live in it.
    const bool shares =
        visible != nullptr && has_known_poses(session, Modality::visible);
    return ThermalPoses{std::move(poses), shares};
  }
  const auto frames = session.frames_of(Modality::thermal, options.use_tracking_frames);
  if (frames.size() < 2)
    return fail(ErrorKind::input, session.folder.string(),
                fmt::format("{} thermal frames, at least 2 are needed", frames.size()),
                "record or import more views");
  std::vector<LadderStep> steps;
  ORBITFUSE_ASSIGN(ModalityPoses poses, structure_from_motion(session, frames, options,
                                                              workdir / "thermal", progress,
                                                              steps));
  poses.ladder = std::move(steps);
  return ThermalPoses{std::move(poses), false};
}

}  // namespace orbitfuse
