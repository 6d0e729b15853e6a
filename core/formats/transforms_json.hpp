// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
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
  Rigid3d cam_from_world;   ///< axes as in Camera: x right, y down, z forward; the file's unit
  std::string source = {};  ///< written only: "folder/name" of the user's own file; empty: none
};

struct Transforms {
  std::vector<TransformsFrame> frames;
  /// Read only: in how many frames there is a file that nothing here uses, by its key
  /// ("mask_path").
  std::map<std::string, int> unused = {};
};

/// nerfstudio / instant-ngp transforms.json: OpenGL camera-to-world there, turned to Camera's axes
/// here; shared or per-frame intrinsics (fl_x or camera_angle_x), pixels. Errors: input, naming
/// file and frame (no JSON, no frames, no size, no focal length, text where a number belongs, an
/// angle that can't be radians, a lens that is no pinhole with k1, k2, p1, p2, a matrix that is no
/// rigid pose). Of the images only the first is looked at, and only where the file names no size.
Result<Transforms> read_transforms_json(const std::filesystem::path& file);

/// Writes the views, poses turned back to OpenGL's axes, with a `conventions` block. Errors:
/// device.
Status write_transforms_json(const std::filesystem::path& file, const Transforms& transforms);

}  // namespace orbitfuse
