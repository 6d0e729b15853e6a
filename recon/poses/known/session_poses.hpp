// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "recon/poses/estimate_poses.hpp"

namespace orbitfuse {

/// Whether frames with poses from outside can stand for the modality: at least two, and their
/// intrinsics are known from the frame or its device.
bool has_known_poses(const Session& session, Modality modality);

/// The posed frames in the session's world; those without a pose are named in `dropped`.
Result<ModalityPoses> known_poses(const Session& session, Modality modality);

/// As if the modality's poses had not been given; of the cameras that came with them the focal
/// length is left, times `true_focal`, as what a user says of it, since it may be wrong as well.
Session without_known_poses(Session session, Modality modality, double true_focal);

}  // namespace orbitfuse
