// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

/// Structure from motion of visible views. Orbit pairs at reduced size are tried first and stay
/// where they pose every view. What they leave out is resected on their points, gets the remaining
/// pairs, then features at full settings, then all pairs at full settings; where COLMAP's mapper
/// finds no model that the gates believe, the global mapper takes over. Each step runs only where
/// the ones before left views out, on the features and matches in the database; the believed model
/// with the most views is the answer.
/// The ladder of a failure is in `steps` as well as in the error's message.
/// Errors: input, unavailable (no COLMAP), quality (no attempt held), cancelled.
Result<ModalityPoses> pose_visible_views(const Session& session,
                                         const std::vector<const FrameRecord*>& frames,
                                         const PoseOptions& options,
                                         const std::filesystem::path& workdir,
                                         const Progress& progress, std::vector<LadderStep>& steps);

}  // namespace orbitfuse
