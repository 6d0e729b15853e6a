// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "core/geometry/camera.hpp"
#include "core/session/session.hpp"

// What a session knows of the lens that took a frame, before anything is estimated.
namespace orbitfuse {

/// The device's calibrated camera at a frame's size (its own where that is not known: 0); none
/// where the session has none.
std::optional<Camera> calibrated_camera(const Session& session, const std::string& device,
                                        int width, int height);

/// Calibrated; else of the device's focal length, else of the guessed one, with its principal point
/// in the middle.
Camera prior_camera(const Session& session, const FrameRecord& frame, double guessed_focal_px);

/// The same where COLMAP would guess: 1.2 times the longer side.
Camera sfm_prior_camera(const Session& session, const FrameRecord& frame);

}  // namespace orbitfuse
