// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/recording/camera_spec.hpp"
#include "capture/frame_source.hpp"
#include "capture/guide/coverage.hpp"

namespace orbitfuse::recording {

/// Cameras as named on the command line, not started yet.
struct Cameras {
  std::vector<std::unique_ptr<FrameSource>> sources;
  bool live = false;      ///< at least one runs until it is stopped
  bool stations = false;  ///< the frames carry their stations
  /// Where such stations lie; nothing for live cameras.
  std::optional<OrbitPlan> plan;
};

/// Adds the camera of `spec` for a modality: one source, or for a replay one per device of it.
/// `profiles`: folder of camera profiles; empty: the one that came with the program.
Status add_cameras(const CameraSpec& spec, Modality modality, const std::filesystem::path& profiles,
                   Cameras& cameras);

/// config/cameras beside the program or in a parent folder of it; empty when there is none.
std::filesystem::path shipped_profiles();

}  // namespace orbitfuse::recording
