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

}  // namespace orbitfuse
