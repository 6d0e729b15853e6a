// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/result.hpp"

namespace orbitfuse {

struct TransformsFrame {
  std::string file_path;                         ///< as written, relative to the JSON
  std::optional<std::string> thermal_file_path;  ///< ThermoNeRF's aligned pairs
  Camera camera;
  Rigid3d cam_from_world;
};

struct Transforms {
  std::vector<TransformsFrame> frames;
};

/// nerfstudio / instant-ngp transforms.json: OpenGL camera-to-world; shared or per-frame
/// intrinsics (fl_x or camera_angle_x). A frame's missing size is an input error naming it.
Result<Transforms> read_transforms_json(const std::filesystem::path& file);

/// Writes the views with a `conventions` block.
Status write_transforms_json(const std::filesystem::path& file, const Transforms& transforms);

}  // namespace orbitfuse
