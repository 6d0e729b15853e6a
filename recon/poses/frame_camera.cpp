// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/frame_camera.hpp"

#include <algorithm>

namespace orbitfuse {

std::optional<Camera> calibrated_camera(const Session& session, const std::string& device,
                                        int width, int height) {
  const DeviceInfo* info = session.device(device);
  if (info == nullptr || !info->lens.calibrated) return std::nullopt;
  if (width <= 0 || height <= 0) return info->lens.calibrated;
  return info->lens.calibrated->scaled_to(width, height);
}

Camera prior_camera(const Session& session, const FrameRecord& frame, double guessed_focal_px) {
  if (const auto calibrated = calibrated_camera(session, frame.device, frame.width, frame.height))
    return *calibrated;
  const DeviceInfo* device = session.device(frame.device);
  Camera camera;
  camera.width = frame.width, camera.height = frame.height;
  camera.cx = frame.width / 2.0, camera.cy = frame.height / 2.0;
  camera.fx = camera.fy =
      device != nullptr && device->lens.focal_px ? *device->lens.focal_px : guessed_focal_px;
  return camera;
}

Camera sfm_prior_camera(const Session& session, const FrameRecord& frame) {
  return prior_camera(session, frame, 1.2 * std::max(frame.width, frame.height));
}

}  // namespace orbitfuse
