// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

/// Structure from motion of visible views. Orbit pairs at reduced size are tried first and stay
/// where they pose every view. While no model is believed: views resected on one that is only too
/// small, features of faint texture in place of the usual ones, ever more relaxed settings of
/// COLMAP's mapper, the global mapper. What a believed model leaves out is resected on its points.
/// Then, with a model or without: the remaining pairs, features at full settings. Each step runs
/// only where the ones before left views out, on the features and matches in the database. The
/// answer is the believed model with the most views, not the first; the global mapper's takes the
/// place of a relaxed one that has no more views and explains fewer matches. Its views are matched
/// again along their own epipolar lines where that makes many more observations of few. Last, the
/// images themselves place each observation, and further ones. The ladder of a failure is in
/// `steps` as well as in the error's message. Errors: input, unavailable (no COLMAP), quality (no
/// attempt held), cancelled.
Result<ModalityPoses> pose_visible_views(const Session& session,
                                         const std::vector<const FrameRecord*>& frames,
                                         const PoseOptions& options,
                                         const std::filesystem::path& workdir,
                                         const Progress& progress, std::vector<LadderStep>& steps);

}  // namespace orbitfuse
