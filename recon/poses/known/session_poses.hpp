// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

/// Whether frames with poses from outside can stand for the modality: at least two, and their
/// intrinsics are known from the frame or its device.
bool has_known_poses(const Session& session, Modality modality);

/// The posed frames in the session's world; those without a pose are named in `dropped`.
Result<ModalityPoses> known_poses(const Session& session, Modality modality);

/// The frames of a session's views, in the same order.
std::vector<const FrameRecord*> frames_of(const Session& session,
                                          const std::vector<PosedView>& views);

/// Views by index, and what speaks against the pose of each.
using NamedViews = std::vector<std::pair<std::size_t, std::string>>;

/// Drops the `wrong` views of known poses and doubts others for `reason`, by name.
void take_known_verdicts(const NamedViews& wrong, const NamedViews& doubtful, DoubtReason reason,
                         ModalityPoses& poses);

/// As if the modality's poses had not been given; of the cameras that came with them the focal
/// length is left, times `true_focal`, as what a user says of it, since it may be wrong as well.
Session without_known_poses(Session session, Modality modality, double true_focal);

}  // namespace orbitfuse
