// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/thermal_lens.hpp"

#include <algorithm>

#include "recon/poses/frame_camera.hpp"

namespace orbitfuse {

LensGuess lens_of(const Session& session, const FrameRecord& frame) {
  constexpr double usual_focal_by_side = 1.7, guessed_sigma = 0.3;
  LensGuess guess;
  guess.camera =
      prior_camera(session, frame, usual_focal_by_side * std::max(frame.width, frame.height));
  if (calibrated_camera(session, frame.device, frame.width, frame.height)) {
    guess.focal_relative_sigma = guess.radial_sigma = 0;
    return guess;
  }
  const DeviceInfo* device = session.device(frame.device);
  guess.guessed = device == nullptr || !device->lens.focal_px;
  guess.focal_relative_sigma = guess.guessed ? guessed_sigma : device->lens.focal_relative_sigma;
  return guess;
}

}  // namespace orbitfuse
