// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/thermal_lens.hpp"

namespace orbitfuse {

LensGuess lens_of(const Session& session, const FrameRecord& frame) {
  constexpr double usual_focal_by_width = 1.7, guessed_sigma = 0.3;
  LensGuess guess;
  const DeviceInfo* device = session.device(frame.device);
  if (device != nullptr && device->lens.calibrated) {
    guess.camera = device->lens.calibrated->scaled_to(frame.width, frame.height);
    guess.focal_relative_sigma = guess.radial_sigma = 0;
    return guess;
  }
  double focal = usual_focal_by_width * frame.width;
  guess.focal_relative_sigma = guessed_sigma;
  guess.guessed = device == nullptr || !device->lens.focal_px;
  if (!guess.guessed) {
    focal = *device->lens.focal_px;
    guess.focal_relative_sigma = device->lens.focal_relative_sigma;
  }
  guess.camera.width = frame.width, guess.camera.height = frame.height;
  guess.camera.fx = guess.camera.fy = focal;
  guess.camera.cx = frame.width / 2.0, guess.camera.cy = frame.height / 2.0;
  return guess;
}

}  // namespace orbitfuse
