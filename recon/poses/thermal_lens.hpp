// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/geometry/camera.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

struct LensGuess {
  Camera camera;
  double focal_relative_sigma = 0.03;
  /// Of k1 beside the camera's: lenses of 25 to 45 degrees have -0.3 to 0.
  double radial_sigma = 0.2;
  bool guessed = false;  ///< nothing was known
};
/// What the session knows of the lens that took a thermal frame; without any prior 33 degrees,
/// between the usual thermal lenses, with a sigma of 30 %.
LensGuess lens_of(const Session& session, const FrameRecord& frame);

}  // namespace orbitfuse
